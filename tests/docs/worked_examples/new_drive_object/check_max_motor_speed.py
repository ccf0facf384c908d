"""Runs in a copy of the tree that writes the object at boot; see docs/development.md."""

import struct
from pathlib import Path

import pytest
from cia306 import findings

from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.node.dictionary import Dictionary
from hil_sim.node.sdo_abort import SdoAbort
from servo_ctrl.canopen.node_plan import Write
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.config.load import load_machine

ROOT = Path.cwd()
EDS = ROOT / "eds" / "servo_drive.eds"
MACHINE = load_machine(ROOT / "machines" / "xy_table")


def write_to(axis: str) -> Write:
    (plan,) = (plan for plan in plan_machine(MACHINE) if plan.key == f"axis.{axis}.drive")
    (write,) = (write for write in plan.writes if write.index == 0x6080)
    return write


@pytest.mark.parametrize("axis", ["x", "y"])
def test_boot_writes_the_max_motor_speed_of_a_drive(axis: str) -> None:
    config = MACHINE.axes[axis]
    turns_per_minute = struct.unpack("<I", write_to(axis).data)[0]
    assert 0.0 <= turns_per_minute - 60.0 * config.limits.velocity_mm_s / config.transmission.lead_mm < 1.0


def test_the_data_sheet_is_clean_and_the_simulated_drive_takes_the_object() -> None:
    assert findings(EDS) == []
    drive = Dictionary(1, EDS, DriveObjects())
    assert drive.value(0x6080) == 30_000
    drive.set_data(0x6080, 0, write_to("x").data)
    assert drive.get_data(0x6080, 0) == write_to("x").data
    with pytest.raises(SdoAbort):
        drive.set_data(0x6080, 0, bytes(4))
