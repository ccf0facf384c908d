"""A controlled stop whose set points stand still while an axis moves: something has pushed it."""

from pathlib import Path

from ideal_drives import COUNT_M, PERIOD_S, Stand, ideal_machine_file

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.drives import COASTS_M_S

QUICK_STOP, DISABLE_VOLTAGE = 0x02, 0x00


def stopped_at(tmp_path: Path, velocity_m_s: float) -> Stand:
    """In ready, where the references rest, one axis is moved by as much as that is in a cycle."""
    stand = Stand(ideal_machine_file(tmp_path)).run(60)
    assert stand.machine.stage is Stage.READY
    stand.drives[0].position += round(velocity_m_s * PERIOD_S / COUNT_M)
    stand.machine.event(Event.EMCY, "an emergency message of the other drive")
    return stand.run(1)


def test_axis_that_moves_is_braked_before_its_power_goes(tmp_path: Path) -> None:
    stand = stopped_at(tmp_path, 0.2)
    assert stand.machine.stage is Stage.QUICK_STOPPING
    stand.run(1)
    assert [drive.controlwords[-1] for drive in stand.drives] == [QUICK_STOP, QUICK_STOP]
    assert stand.run(300).machine.stage is Stage.OFF


def test_axis_that_creeps_loses_its_power_at_once(tmp_path: Path) -> None:
    stand = stopped_at(tmp_path, 0.8 * COASTS_M_S)
    assert stand.machine.stage is Stage.DISABLING
    stand.run(1)
    assert [drive.controlwords[-1] for drive in stand.drives] == [DISABLE_VOLTAGE, DISABLE_VOLTAGE]
