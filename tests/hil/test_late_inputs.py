"""Inputs that come late while a drive is homed once more: its answer is not that of the homing before."""

import pytest
from consecutive_runs import ConsecutiveRuns, Script
from fault_scripts import jogged

from servo_ctrl.axis.drive import Phase
from servo_ctrl.commands.command import Command
from servo_ctrl.commands.stage import Stage

DRIVE_X, SCALE_X = 0x181, 0x18B
LATE = 12
"""Cycles; up to 20 are sailed through."""


def away_from_home(table: ConsecutiveRuns, velocity_m_s: float) -> Script:
    table.ask(Command.ENABLE)
    yield table.at(Stage.READY)
    yield from jogged(table, velocity_m_s, 200)


def keep_back(table: ConsecutiveRuns, can_id: int) -> None:
    """From now on this node's inputs come late."""
    kept: list[bytes] = []

    def inbound(arriving_id: int, data: bytes) -> list[tuple[int, bytes]]:
        if arriving_id != can_id:
            return [(arriving_id, data)]
        kept.append(data)
        return [(can_id, kept.pop(0))] if len(kept) > LATE else []

    table.wire.inbound = inbound


def homing(table: ConsecutiveRuns) -> bool:
    return bool(table.servo.sequence.phase is Phase.HOMING)


@pytest.mark.parametrize("can_id", [DRIVE_X, SCALE_X])
def test_set_points_begin_at_the_homed_position(table: ConsecutiveRuns, can_id: int) -> None:
    """In a new run, and homed anew in the same one: the encoder jumps to zero, and the scale does not."""

    def first() -> Script:
        yield table.at(Stage.STANDBY)
        yield from away_from_home(table, 0.05)
        assert abs(table.machine.set_points_m()[0]) > 0.005

    def second() -> Script:
        yield table.at(Stage.STANDBY)
        table.ask(Command.ENABLE)
        yield lambda: homing(table)
        keep_back(table, can_id)
        yield table.at(Stage.READY, Stage.STANDBY)
        assert table.machine.set_points_m()[0] == pytest.approx(0.0, abs=1e-4)
        table.wire.inbound = None
        table.ask(Command.DISABLE)
        yield table.at(Stage.STANDBY)
        yield from away_from_home(table, -0.05)
        table.ask(Command.HOME, "x")
        keep_back(table, can_id)
        yield table.at(Stage.READY, Stage.STANDBY)
        assert table.machine.set_points_m()[0] == pytest.approx(0.0, abs=1e-4)
        yield 50

    for script in (first, second):
        report = table.run(script)
        assert report.reason == "stopped by SIGTERM"
        assert not report.failed
    assert report.missing_inputs >= 2 * LATE
