"""Roles of columns, their names in recordings, and their units."""

import math
from typing import NamedTuple

AffineToSi = tuple[float, float]
"""SI = factor * value + offset."""

UNITS: dict[str, dict[str, AffineToSi]] = {
    "time": {"s": (1.0, 0.0), "ms": (1e-3, 0.0), "us": (1e-6, 0.0), "ns": (1e-9, 0.0)},
    "length": {
        "m": (1.0, 0.0),
        "mm": (1e-3, 0.0),
        "um": (1e-6, 0.0),
        "nm": (1e-9, 0.0),
        "rad": (1.0, 0.0),
        "mrad": (1e-3, 0.0),
        "urad": (1e-6, 0.0),
        "deg": (math.pi / 180.0, 0.0),
    },
    "force": {"n": (1.0, 0.0), "kn": (1e3, 0.0), "nm": (1.0, 0.0), "mnm": (1e-3, 0.0)},
    "current": {"a": (1.0, 0.0), "ma": (1e-3, 0.0)},
    "voltage": {"v": (1.0, 0.0), "mv": (1e-3, 0.0)},
    "temperature": {"k": (1.0, 0.0), "degc": (1.0, 273.15), "c": (1.0, 273.15)},
    "velocity": {"m_s": (1.0, 0.0), "mm_s": (1e-3, 0.0), "um_s": (1e-6, 0.0), "mm_min": (1e-3 / 60.0, 0.0)},
    "number": {"1": (1.0, 0.0)},
}
"""Dimension -> unit as the suffix of a name (`_mm`) -> conversion to SI.

On a rotary axis a position is in rad, and a force is a torque in N m.
"""
SUFFIXES = sorted(
    ((unit, dimension) for dimension, units in UNITS.items() for unit in units if unit != "1"),
    key=lambda pair: -len(pair[0]),
)


class Role(NamedTuple):
    """The role of a column. `stems`: names without unit that have this role."""

    name: str
    dimension: str
    stems: tuple[str, ...]
    meaning: str


ROLES: dict[str, Role] = {
    role.name: role
    for role in (
        Role("time", "time", ("time", "t"), "time of the samples"),
        Role("position", "length", ("motor_position", "joint_position"), "motor encoder, at the table"),
        Role(
            "force",
            "force",
            ("motor_force", "force", "motor_torque", "joint_torque", "torque"),
            "measured motor force, at the table",
        ),
        Role("current", "current", ("motor_current",), "motor current"),
        Role("voltage", "voltage", ("motor_voltage",), "voltage that is proportional to the force"),
        Role("scale", "length", ("scale_position", "load_position"), "linear scale, or encoder of the load"),
        Role("reference", "length", ("position_command",), "position command"),
        Role("force_command", "force", ("force_command",), "commanded motor force"),
        Role("temperature", "temperature", ("temperature",), "temperature of the drive"),
        Role("statusword", "number", ("statusword",), "statusword of the drive (6041h)"),
        Role("mode", "number", ("modes_of_operation",), "mode of operation (6060h)"),
    )
}
ANGULAR = frozenset({"rad", "mrad", "urad", "deg"})
"""Units of position that only a rotary axis has."""
TORQUES = frozenset({"nm", "mnm"})
"""Units of force that only a rotary axis has: torques."""
REQUIRED = "time, a motor position, and a motor force, current or voltage"


def normal_unit(unit: str) -> str:
    """Convert a unit of a file (`mm/s`, `µm`, `°C`) to the suffix of a name."""
    plain = unit.strip().strip("[]()").replace("µ", "u").replace("μ", "u").replace("°", "deg")
    return plain.replace("/", "_").replace(" ", "").lower()


def is_unit(unit: str) -> bool:
    """Return whether a cell of a file is a known unit."""
    return any(normal_unit(unit) in units for units in UNITS.values())


def unit_of_name(name: str) -> tuple[str, str, str]:
    """Split a name such as `motor_position_mm` into stem, unit and dimension, empty without a unit."""
    lower = name.lower()
    for unit, dimension in SUFFIXES:
        if lower.endswith("_" + unit):
            return name[: -len(unit) - 1], unit, dimension
    return name, "", ""
