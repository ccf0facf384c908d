"""Units of a drive, read from it at boot: position units per revolution, units of velocity and acceleration.

    position units per motor revolution = feed constant 6092h (else: resolution 608Fh) / gear ratio 6091h

if 60A8h is increments or 0; revolutions, degrees and metres define the number themselves (CiA 402-2).

The controller computes set points with the numbers of the machine file. A drive with other numbers would move
by other amounts, so boot refuses it.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from servo_ctrl.config.drive_units import drive_unit
from servo_ctrl.config.model import AxisConfig

Values = Mapping[tuple[int, int], int]
ENCODER, GEAR, FEED, VELOCITY_FACTOR = 0x608F, 0x6091, 0x6092, 0x6096
POSITION_UNIT, VELOCITY_UNIT, ACCELERATION_UNIT = 0x60A8, 0x60A9, 0x60AA
RATIOS = (ENCODER, GEAR, FEED, VELOCITY_FACTOR)
POSITION_RANGE = 0x607B
WHOLE_RANGE = (-(1 << 31), (1 << 31) - 1)
"""Position range without wrap-around before that of the data type."""
UNITS = (POSITION_UNIT, VELOCITY_UNIT, ACCELERATION_UNIT)
ADDRESSES = (
    *((index, sub) for index in (*RATIOS, POSITION_RANGE) for sub in (1, 2)),
    *((index, 0) for index in UNITS),
)
"""Addresses of all entries that are read."""
_NUMERATOR = 0x00FF_0000
INCREMENT, REVOLUTION, DEGREE, METRE = 0x00B5_0000, 0x00B4_0000, 0x0041_0000, 0x0001_0000
"""Unit codes in the numerator of 60A8h (CiA 303-2)."""


class DriveUnits(NamedTuple):
    """Units of a drive according to the machine file; `key`: section of the drive."""

    key: str
    counts_per_rev: int
    lead_m: float
    velocity: str
    velocity_code: int | None
    acceleration: str
    acceleration_code: int | None

    def objections(self, values: Values) -> Iterator[str]:
        """Yield why a drive with these values of `ADDRESSES` cannot follow the controller's set points."""
        per_rev = self._positions_per_rev(values)
        if isinstance(per_rev, str):
            yield per_rev
        elif per_rev is not None and abs(per_rev - self.counts_per_rev) > 1e-6 * self.counts_per_rev:
            yield (
                f"has {per_rev:.10g} positions a motor revolution ({_ratios_text(values)}), the machine file "
                f"says {self.counts_per_rev} ({self.key}.counts_per_rev); correct the one that is wrong"
            )
        if _ratio(values, VELOCITY_FACTOR) not in {None, 1.0}:
            numerator, denominator = (values[VELOCITY_FACTOR, subindex] for subindex in (1, 2))
            advice = f"set it to 1/1 and say its unit in {self.key}.velocity_unit"
            yield f"scales velocities by 6096h = {numerator}/{denominator}; {advice}"
        low, high = (values.get((POSITION_RANGE, subindex), 0) for subindex in (1, 2))
        if low < high and (low, high) != WHOLE_RANGE:
            yield (
                f"wraps its positions at the ends of 607Bh = {low} to {high}, which no axis here can use; "
                f"set it to {WHOLE_RANGE[0]} and {WHOLE_RANGE[1]}"
            )
        for index, text, code, key in (
            (VELOCITY_UNIT, self.velocity, self.velocity_code, "velocity_unit"),
            (ACCELERATION_UNIT, self.acceleration, self.acceleration_code, "acceleration_unit"),
        ):
            drive_code = values.get((index, 0), 0)
            if drive_code and code is not None and drive_code != code:
                yield (
                    f"has the unit {index:04X}h = {drive_code:08X}h, the machine file says {code:08X}h, "
                    f"{text} ({self.key}.{key}); correct the one that is wrong"
                )

    def _positions_per_rev(self, values: Values) -> float | str | None:
        """Return position units per motor revolution; None if not stated, a text for an unknown unit."""
        code = values.get((POSITION_UNIT, 0), 0)
        exponent = (code >> 24 ^ 0x80) - 0x80
        gear = _ratio(values, GEAR)
        numerator = code & _NUMERATOR
        if numerator in {0, INCREMENT} and exponent == 0:
            turn = _ratio(values, FEED)
            turn = _ratio(values, ENCODER) if turn is None else turn
            return None if turn is None else turn / (1.0 if gear is None else gear)
        revolution = {REVOLUTION: 1.0, DEGREE: 360.0, METRE: self.lead_m}.get(numerator)
        if revolution is not None:
            return revolution * 10.0**-exponent
        return f"has positions in a unit that is not known here, 60A8h = {code:08X}h"


def units_of(axis_key: str, axis: AxisConfig) -> DriveUnits:
    """Return the units of an axis's drive according to the machine file."""
    drive = axis.drive
    return DriveUnits(
        key=f"{axis_key}.drive",
        counts_per_rev=drive.counts_per_rev,
        lead_m=axis.transmission.lead_mm * 1e-3,
        velocity=drive.velocity_unit,
        velocity_code=drive_unit(drive.velocity_unit, drive.counts_per_rev).code,
        acceleration=drive.acceleration_unit,
        acceleration_code=drive_unit(drive.acceleration_unit, drive.counts_per_rev).code,
    )


def _ratio(values: Values, index: int) -> float | None:
    """Return the ratio of the two entries of an object; None if the drive lacks it, or either is 0."""
    numerator, denominator = values.get((index, 1)), values.get((index, 2), 1)
    return numerator / denominator if numerator and denominator else None


def _ratios_text(values: Values) -> str:
    ratios = (
        f"{index:04X}h = {values[index, 1]}/{values.get((index, 2), 1)}"
        for index in (ENCODER, GEAR, FEED)
        if (index, 1) in values
    )
    unit = values.get((POSITION_UNIT, 0))
    return ", ".join((*ratios, *([f"60A8h = {unit:08X}h"] if unit else [])))
