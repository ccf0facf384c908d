"""Units of a rotary axis, whose coordinate is an angle: 1 m stands for 1 rad in all of the engine."""

UNITS = {
    "N": "N m",
    "m": "rad",
    "kg": "kg m^2",
    "m/s": "rad/s",
    "m/s^2": "rad/s^2",
    "N s/m": "N m s/rad",
    "N s^2/m^2": "N m s^2/rad^2",
    "N/m": "N m/rad",
    "m/N": "rad/(N m)",
}
"""Unit of the engine -> what it is on a rotary axis."""


def unit_of(unit: str, *, rotary: bool) -> str:
    """A unit of the engine as the axis has it."""
    return UNITS.get(unit, unit) if rotary else unit
