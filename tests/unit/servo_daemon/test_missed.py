"""Too many missed ticks on the machine (the counts by themselves: `test_missed_ticks.py`)."""

from pathlib import Path

from ideal_drives import PERIOD_S, Stand, ideal_machine_file

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.missed_ticks import MissedTicks


def test_too_many_missed_ticks_stop_the_axes(tmp_path: Path) -> None:
    stand = Stand(ideal_machine_file(tmp_path)).start()
    stand.machine._missed = MissedTicks(PERIOD_S, 30)
    stand.run(6, elapsed=6)
    assert stand.machine.stage is Stage.RUNNING
    stand.run(1, elapsed=6)
    assert stand.machine.stage is Stage.STOPPING
    assert [event for event, _ in stand.faults] == [Event.LATE_TICK]
    assert stand.run(300).machine.stage is Stage.OFF
