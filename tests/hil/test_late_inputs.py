"""Late inputs during a second homing: the position of the first is not mistaken for that of the second."""

import pytest
from consecutive_runs import ConsecutiveRuns, Script
from fault_scripts import jogged

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.stage import Stage
from servo_ctrl.cyclic.drive_phases import Phase

DRIVE_X, SCALE_X = 0x181, 0x18B
LATE = 12
"""Delay in cycles; up to 20 are tolerated."""


def away_from_home(table: ConsecutiveRuns, velocity_m_s: float) -> Script:
    table.ask(Command.ENABLE)
    yield table.at(Stage.READY)
    yield from jogged(table, velocity_m_s, 200)


def delay_inputs(table: ConsecutiveRuns, can_id: int) -> None:
    """Delay the inputs of this node by `LATE` cycles from now on."""
    queue: list[bytes] = []

    def inbound(arriving_id: int, data: bytes) -> list[tuple[int, bytes]]:
        if arriving_id != can_id:
            return [(arriving_id, data)]
        queue.append(data)
        return [(can_id, queue.pop(0))] if len(queue) > LATE else []

    table.wire.inbound = inbound


def homing(table: ConsecutiveRuns) -> bool:
    return bool(table.servo.phase is Phase.HOMING)


@pytest.mark.parametrize("can_id", [DRIVE_X, SCALE_X])
def test_set_points_begin_at_the_homed_position(table: ConsecutiveRuns, can_id: int) -> None:
    """In a new run, and homed again in the same run: the encoder jumps to zero, the scale does not."""

    def first() -> Script:
        yield table.at(Stage.STANDBY)
        yield from away_from_home(table, 0.05)
        assert abs(table.machine.set_points_m()[0]) > 0.005

    def second() -> Script:
        yield table.at(Stage.STANDBY)
        table.ask(Command.ENABLE)
        yield lambda: homing(table)
        delay_inputs(table, can_id)
        yield table.at(Stage.READY, Stage.STANDBY)
        assert table.machine.set_points_m()[0] == pytest.approx(0.0, abs=1e-4)
        table.wire.inbound = None
        table.ask(Command.DISABLE)
        yield table.at(Stage.STANDBY)
        yield from away_from_home(table, -0.05)
        table.ask(Command.HOME, "x")
        delay_inputs(table, can_id)
        yield table.at(Stage.READY, Stage.STANDBY)
        assert table.machine.set_points_m()[0] == pytest.approx(0.0, abs=1e-4)
        yield 50

    for script in (first, second):
        report = table.run(script)
        assert report.reason == "stopped by SIGTERM"
        assert not report.failed
    assert report.missing_inputs >= 2 * LATE
