"""The kinds of effects: the place in the plant where an effect acts, and its functions.

An effect's module has `KIND`, `Params`, `NEUTRAL` (values without effect, or None if there are none) and the
functions of its kind. An effect with memory also has `State`, its record in the plant's state: the defaults
are the values at power-up; if these depend on the parameters, `powered_up(p)` returns them.

`p` is a `Params` tuple in a test and a record in the plant, `s` the effect's state record, which functions
change in place. Only the functions of an effect with `State` take `s`.

The plant finds the effects of a kind in the registry, so that a new effect needs no line in the plant. It
applies them by `ORDER` (default 0), then by name: so sums keep their bits, and a current passes from the set
point to the iron. `COMMON = True` marks effects of nearly every axis, which the plant evaluates at every
substep; it evaluates the others only if an axis has any of their group.

`NEEDS` names a section that a plant file with this effect must have; `LIST_ENDS_AT` names the list whose
first zero ends the effect's lists. `problems(p, axis)` yields (key, reason) for values that are valid
individually but cannot be simulated together; an empty key means the section.
"""

from collections.abc import Mapping
from enum import Enum
from typing import Any, NamedTuple


class AxisContext(NamedTuple):
    """The axis of a plant file, for the check `problems(p, axis)` of an effect."""

    effects: Mapping[str, Any]
    """`Params` of all effects of the axis, by section."""
    moved_kg: float
    """Mass of the table and of everything rigidly coupled to it."""
    dt_s: float
    """Duration of a substep."""


class Role(NamedTuple):
    """The place where a kind acts, and its functions with arguments; `turn_rad_m` is 2 pi / lead."""

    acts: str
    functions: tuple[tuple[str, str], ...]
    memory: tuple[tuple[str, str], ...] = ()
    """Functions of an effect with `State`, which advance it by `dt_s`."""


_ERROR = (("error_m", "p s position_m turn_rad_m"),)
_FORCE = (("force_n", "p position_m turn_rad_m"),)
_USE = (("advance", "p s friction_w speed_m_s dt_s"),)
_CONTACT = (("force_and_damping", "p s velocity_m_s level"), ("slide", "p s velocity_m_s level dt_s"))


class Kind(Enum):
    """Kind of an effect. The plant names each effect of the kinds WINDING, COUPLING, GAP and SENSOR."""

    WINDING = Role("voltage to current", (("current_a", "p current voltage_v back_emf_v dt_s"),))
    CURRENT_PATH = Role(
        "reported current to the one that makes force", (("passed_a", "p s current back_emf_v dt_s"),)
    )
    FORCE_SHARE = Role("factor on the force of the current", (("share", "p position_m turn_rad_m"),))
    MOTOR_FORCE = Role("sum of forces on the motor side", _FORCE)
    TABLE_FORCE = Role("sum of forces on the table", _FORCE)
    FORCE_IN_TIME = Role("sum of forces on the table, by time", (("force_n", "p time_s"),))
    MEMORY_FORCE = Role(
        "sum of forces on the table, by the motion before",
        (("force_n", "p s"),),
        (("slide", "p s velocity_m_s dt_s"),),
    )
    CHANGE_IN_TIME = Role(
        "sums of forces on the table, levels, dampings and masses, by time",
        (
            ("force_n", "p time_s"),
            ("level_n", "p time_s"),
            ("damping_n_s_m", "p time_s"),
            ("added_kg", "p time_s"),
        ),
    )
    CHANGE_WITH_POSITION = Role(
        "sums of dampings and masses, by the position",
        (("damping_n_s_m", "p position_m"), ("added_kg", "p position_m")),
    )
    MASS = Role("moved mass", (("added_kg", "p"),))
    FRICTION_LEVEL = Role("sum of friction levels", (("level_n", "p speed_m_s"),))
    FRICTION_SPEED = Role("sum of friction levels, by the velocity", (("level_n", "p velocity_m_s"),))
    FRICTION_LOAD = Role(
        "sum of friction levels, by the transmitted force", (("level_n", "p transmitted_n friction_n"),)
    )
    FRICTION_POSITION = Role("sum of friction levels, by the position", (("level_n", "p position_m"),))
    FRICTION_DWELL = Role(
        "sum of friction levels, by the dwell",
        (("level_n", "p s"), ("slide", "p s velocity_m_s dt_s")),
    )
    FRICTION_DIRECTION = Role("sum of friction levels, by the direction", (("level_n", "p direction"),))
    DAMPING = Role("sum of dampings", (("damping_n_s_m", "p velocity_m_s"),))
    FRICTION_CHANGE = Role("factors on levels and damping", (("factors", "p s time_s"),), _USE)
    PRESLIDING = Role("contact that shapes the sum of the levels; an axis has one", _CONTACT)
    PRESLIDING_LEVEL = Role("contact that adds a level of its own", _CONTACT)
    POSITION_ERROR = Role(
        "sum of errors between screw and table", (*_ERROR, ("slope", "p s position_m turn_rad_m")), _USE
    )
    COUPLING = Role("spring between two masses", (("force_n", "p deflection_m rate_m_s"),))
    GAP = Role("gap in front of a spring", (("deflection_m", "p gap_m"),))
    SENSOR = Role("position to counts", (("counts", "p position_m"),))
    ENCODER_READING = Role("sum of errors of the motor encoder", _ERROR)
    SCALE_READING = Role("sum of errors of the scale", _ERROR)
    CROSS_READING = Role("error of the scale by another axis", (("error_m", "p s"),))
