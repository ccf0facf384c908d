"""The kinds of effects: where one acts in the plant, and the functions with which it does.

An effect's module has `KIND`, `Params`, `NEUTRAL` (the values that change nothing, or None where no values
can) and the functions of its kind. With memory it also has `State`, its own record in the plant's state: the
defaults are the values at power-up; where these depend on the parameters, `powered_up(p)` makes them.

`p` is a `Params` tuple in a test and a record in the plant, `s` the effect's own state record, changed in
place. Only the functions of an effect that declares `State` take `s`.

The plant applies the effects of a kind by the registry, so that a new effect needs no line in the plant.
`ORDER` (0 where a module has none) says in which order, and then the name: sums keep their bits by it, and a
current passes from the set point to the iron. `COMMON = True` marks what nearly every axis has: the plant
asks for it at every substep, and for the others only if an axis has any of their group.

`NEEDS` names the section without which a plant file with this one is refused; `LIST_ENDS_AT` the list whose
first zero ends the lists of the effect. `problems(p, axis)` yields (key, reason) for values that make sense
one by one and cannot be simulated together; an empty key is the section.
"""

from collections.abc import Mapping
from enum import Enum
from typing import Any, NamedTuple


class AxisContext(NamedTuple):
    """The axis of a plant file that an effect is checked against, by `problems(p, axis)` of its module."""

    effects: Mapping[str, Any]
    """`Params` of all effects of the axis, by section."""
    moved_kg: float
    """Mass of the table, and of what is rigidly coupled to it."""
    dt_s: float
    """Substep."""


class Role(NamedTuple):
    """Where a kind acts, and the functions with their arguments; `turn_rad_m` is 2 pi / lead."""

    acts: str
    functions: tuple[tuple[str, str], ...]
    memory: tuple[tuple[str, str], ...] = ()
    """Functions that only an effect with `State` has: they advance it by `dt_s`."""


_ERROR = (("error_m", "p s position_m turn_rad_m"),)
_FORCE = (("force_n", "p position_m turn_rad_m"),)
_USE = (("advance", "p s friction_w speed_m_s dt_s"),)
_CONTACT = (("force_and_damping", "p s velocity_m_s level"), ("slide", "p s velocity_m_s level dt_s"))


class Kind(Enum):
    """Kind of an effect. Of a WINDING, COUPLING, GAP or SENSOR the plant knows each by name."""

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
    FRICTION_LOAD = Role("sum of friction levels, by the transmitted force", (("level_n", "p load_n"),))
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
