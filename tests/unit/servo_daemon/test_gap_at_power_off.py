"""A gap in ticks between the end of a controlled stop and power off: drives keep their last set points."""

from pathlib import Path

from ideal_drives import Stand, ideal_machine_file

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.commands.stage import Stage

LONG_GAP, SHORT_GAP = 40, 10
QUICK_STOP, DISABLE_VOLTAGE = 0x02, 0x00


def at_rest_with_power(tmp_path: Path) -> Stand:
    """Ramped down, and not commanded yet to switch power off."""
    stand = Stand(ideal_machine_file(tmp_path)).start()
    stand.run(20)
    stand.machine.event(Event.DISABLE, "switched off")
    while stand.machine.stage is Stage.STOPPING:
        stand.run(1)
    assert stand.machine.stage is Stage.DISABLING
    return stand


def test_drives_brake_before_they_are_switched_off(tmp_path: Path) -> None:
    stand = at_rest_with_power(tmp_path).run(1, elapsed=LONG_GAP)
    assert stand.machine.stage is Stage.QUICK_STOPPING
    assert [drive.controlwords[-1] for drive in stand.drives] == [QUICK_STOP, QUICK_STOP]
    assert stand.run(300).machine.stage is Stage.OFF
    assert not stand.faults


def test_short_gap_changes_nothing(tmp_path: Path) -> None:
    stand = at_rest_with_power(tmp_path).run(1, elapsed=SHORT_GAP)
    assert [drive.controlwords[-1] for drive in stand.drives] == [DISABLE_VOLTAGE, DISABLE_VOLTAGE]


def test_drives_already_without_power_are_left_alone(tmp_path: Path) -> None:
    stand = at_rest_with_power(tmp_path).run(1)
    before = len(stand.drives[0].controlwords)
    stand.run(1, elapsed=LONG_GAP)
    assert QUICK_STOP not in stand.drives[0].controlwords[before:]
