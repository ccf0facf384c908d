"""What presliding remembers of an axis that was without power, and has sprung back by some micrometres."""

from typing import Any

import numpy as np
import pytest
from ideal_drives import COUNT_M, Operate, OperatedStand

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.stage import Stage
from servo_ctrl.control.compensation.learned_waveform import SPRING_BACK_M

LAST_STEP_M = 2e-6
"""Longest way that the ideal drive still goes with its last set point."""


def without_power(made: OperatedStand) -> OperatedStand:
    """Jogged in + direction, then switched off."""
    assert made.handler.jog("x", 0.05).accepted
    made.run(50)
    assert made.ask(Command.DISABLE).accepted
    made.run(300)
    assert made.machine.stage is Stage.STANDBY
    return made


def powered_again(made: OperatedStand, moved_m: float) -> Any:
    """The memory of x after it has moved without power."""
    made.drives[0].position += round(moved_m / COUNT_M)
    assert made.ask(Command.ENABLE).accepted
    made.run(100)
    assert made.machine.stage is Stage.READY
    return memory_of(made)


def memory_of(made: OperatedStand) -> Any:
    return made.machine._drives._memory.axes["law"]["state"]["waveform"][0]


def test_friction_that_sprang_back_is_a_reversal_where_the_axis_lost_its_power(enabled: Operate) -> None:
    made = without_power(enabled())
    left_m = made.positions_m()[0]
    found = powered_again(made, -8e-6)
    assert found["direction"] == -1.0
    assert found["branch"]["turn_1"]["position_m"] == pytest.approx(left_m, abs=LAST_STEP_M)
    assert found["lead_position_m"] == pytest.approx(left_m - 8e-6, abs=LAST_STEP_M)


def test_of_an_axis_that_was_pushed_nothing_is_remembered(enabled: Operate) -> None:
    found = powered_again(without_power(enabled()), 1e-3)
    assert found["direction"] == 0.0
    assert np.isinf(found["branch"]["turn_1"]["position_m"])


def test_homing_forgets_as_it_moves_the_coordinates(enabled: Operate) -> None:
    made = enabled(homing_method=37)
    assert made.handler.jog("x", 5e-4).accepted
    made.run(60)
    assert made.handler.jog("x", 0.0).accepted
    made.run(300)
    assert 0.0 < made.positions_m()[0] < SPRING_BACK_M
    assert memory_of(made)["direction"] == 1.0
    assert made.ask(Command.HOME, "x").accepted
    made.run(60)
    assert made.machine.stage is Stage.READY
    assert memory_of(made)["direction"] == 0.0
