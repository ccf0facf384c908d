"""Units of real drives, used where the machine file says the same and refused where it does not."""

import math
from pathlib import Path

import pytest

from servo_ctrl.canopen.drive_units import DriveUnits, units_of
from servo_ctrl.canopen.scaling import drive_scaling
from servo_ctrl.canopen.settings import drive_settings
from servo_ctrl.config.drive_units import drive_unit
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import AxisConfig, MachineConfig

XY_TABLE = Path(__file__).parents[3] / "machines" / "xy_table"


@pytest.fixture(scope="module")
def table() -> MachineConfig:
    return load_machine(XY_TABLE)


def axis_with(table: MachineConfig, **drive: object) -> AxisConfig:
    axis = table.axes["x"]
    return axis.model_copy(update={"drive": axis.drive.model_copy(update=drive)})


@pytest.mark.parametrize(
    ("text", "counts", "code"),
    [
        ("counts/s", 1.0, 0x00B50300),
        ("0.1 counts/s", 0.1, 0xFFB50300),
        ("rpm", 4096 / 60, 0x00B44700),
        ("0.001 rpm", 4096 / 60e3, 0xFDB44700),
        ("rev/s", 4096, 0x00B40300),
        ("0.03125 counts/s", 1 / 32, None),
        ("rpm/s", 4096 / 60, 0x00C00300),
        ("10 counts/s2", 10.0, None),
    ],
)
def test_a_unit_by_name_is_its_size_and_its_code(text: str, counts: float, code: int | None) -> None:
    unit = drive_unit(text, 4096)
    assert math.isclose(unit.counts, counts, rel_tol=1e-12)
    assert unit.code == code


@pytest.mark.parametrize("text", ["", "rpms", "0 rpm", "-1 rpm", "1e999 rpm", "m/s"])
def test_no_unit_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is not a unit"):
        drive_unit(text, 4096)


UNITS = DriveUnits("axis.x.drive", 10_000, 0.01, "rpm", 0x00B44700, "rpm/s", 0x00C00300)


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({(0x608F, 1): 10_000, (0x608F, 2): 1}, ""),
        ({(0x608F, 1): 4096, (0x608F, 2): 1}, "has 4096 positions"),
        ({(0x608F, 1): 4096, (0x6092, 1): 10_000, (0x6092, 2): 1}, ""),
        ({(0x6092, 1): 100_000, (0x6092, 2): 1, (0x6091, 1): 10, (0x6091, 2): 1}, ""),
        ({(0x60A8, 0): 0xFA01_0000}, ""),  # micrometres, 10 mm a turn
        ({(0x60A8, 0): 0xFD01_0000}, "has 10 positions"),
        ({(0x60A8, 0): 0xFCB4_0000}, ""),  # a 10,000th of a revolution
        ({(0x60A9, 0): 0x00B44700, (0x60AA, 0): 0x00C00300}, ""),
        ({(0x60A9, 0): 0xFDB44700}, "60A9h = FDB44700h, the machine file says 00B44700h, rpm"),
        ({(0x60AA, 0): 0xFDC00300}, "60AAh = FDC00300h"),
        ({(0x6096, 1): 1, (0x6096, 2): 1}, ""),
        ({(0x6096, 1): 60, (0x6096, 2): 1}, "scales velocities by 6096h = 60/1"),
        ({(0x607B, 1): 0, (0x607B, 2): 3599}, "wraps its positions at the ends of 607Bh = 0 to 3599"),
        ({(0x607B, 1): -(2**31), (0x607B, 2): 2**31 - 1}, ""),
        ({(0x607B, 1): 0, (0x607B, 2): 0}, ""),  # as drives say that there is none
        ({}, ""),
    ],
)
def test_values_of_a_drive_are_used_or_refused(values: dict[tuple[int, int], int], complaint: str) -> None:
    assert complaint in "; ".join(UNITS.objections(values))
    assert bool(complaint) == any(UNITS.objections(values))


def test_a_drive_in_rpm_gets_rpm(table: MachineConfig) -> None:
    axis = axis_with(table, velocity_unit="rpm", acceleration_unit="rpm/s")
    lead_m = axis.transmission.lead_mm * 1e-3
    assert math.isclose(drive_scaling(axis).metre_per_s_per_unit, lead_m / 60.0)
    written = {(index, sub): value for index, sub, value, _ in drive_settings(table, "axis.x", axis)}
    limits = axis.limits
    assert written[0x6085, 0] == round(limits.acceleration_mm_s2 / axis.transmission.lead_mm * 60.0)
    assert written[0x6099, 1] == round(0.1 * limits.velocity_mm_s / axis.transmission.lead_mm * 60.0)
    assert units_of("axis.x", axis).velocity_code == 0x00B44700
