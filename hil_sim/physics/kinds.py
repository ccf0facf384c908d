"""The kinds of effects: where in the plant an effect acts, and the functions that it must have.

An effect's module has `KIND`, `Params`, `NEUTRAL` (values without effect, or None if there are none) and the
functions of its kind. An effect with memory also has `State`, its record in the plant's state: the defaults
are the values at power-up; if these depend on the parameters, `powered_up(p)` returns them.

`p` is a `Params` tuple in a test and a record in the plant; `s` is the effect's state record, which functions
change in place. Only the functions of an effect with `State` take `s`.

The plant finds the effects of a kind in the registry, so that a new effect needs no line in the plant. It
applies them by `ORDER` (default 0), then by name: a fixed order of summation keeps results equal to the bit,
and a current passes from the amplifier to the iron core. `COMMON = True` marks effects of nearly every axis,
which the plant evaluates at every substep; it evaluates the others only if an axis has any of their group.

`NEEDS` names a section that a plant file with this effect must have; `LIST_ENDS_AT` names the list whose
first zero ends all lists of the effect. `problems(p, axis)` yields (key, reason) for values that are each
within their bounds but cannot be simulated together; an empty key means the section.
"""

from collections.abc import Mapping
from enum import Enum
from typing import Any, NamedTuple


class AxisContext(NamedTuple):
    """The axis of a plant file, for the check `problems(p, axis)` of an effect."""

    effects: Mapping[str, Any]
    """`Params` of all effects of the axis, by section."""
    moved_kg: float
    """Mass of the table and of everything rigidly coupled to it, kg."""
    dt_s: float
    """Duration of a substep, s."""


class Role(NamedTuple):
    """What a kind computes, and its functions with their arguments; `turn_rad_m` is 2 pi / lead."""

    output: str
    functions: tuple[tuple[str, str], ...]
    state_functions: tuple[tuple[str, str], ...] = ()
    """Functions that an effect has only with `State`; they advance it by `dt_s`."""


class OtherAxis(NamedTuple):
    """State of an effect that follows another axis: the motion of that axis one substep ago."""

    position_m: float = 0.0
    velocity_m_s: float = 0.0
    acceleration_m_s2: float = 0.0


_ERROR = (("error_m", "p s position_m turn_rad_m"),)
_FORCE = (("force_n", "p position_m turn_rad_m"),)
_HEAT_AND_WEAR = (("advance", "p s friction_w speed_m_s dt_s"),)
_CONTACT = (("force_and_damping", "p s velocity_m_s level"), ("slide", "p s velocity_m_s level dt_s"))


class Kind(Enum):
    """Kind of an effect. The plant names each effect of the kinds WINDING, COUPLING, GAP and SENSOR."""

    WINDING = Role(
        "voltage to current",
        (("decay", "p dt_s"), ("current_a", "p current voltage_v back_emf_v decay_of_step")),
    )
    CURRENT_PATH = Role(
        "reported current to force-producing current", (("force_producing_a", "p s current back_emf_v dt_s"),)
    )
    FORCE_RIPPLE = Role(
        "relative change of the force of a current", (("relative_ripple", "p position_m turn_rad_m"),)
    )
    MOTOR_FORCE = Role("sum of forces on the motor side", _FORCE)
    TABLE_FORCE = Role("sum of forces on the table", _FORCE)
    STATE_FORCE = Role(
        "sum of forces on the table, by position and velocity", (("force_n", "p position_m velocity_m_s"),)
    )
    FORCE_IN_TIME = Role("sum of forces on the table, by time", (("force_n", "p time_s"),))
    MEMORY_FORCE = Role(
        "sum of forces on the table, by the previous motion",
        (("force_n", "p s"),),
        (("advance", "p s velocity_m_s dt_s"),),
    )
    CHANGE_IN_TIME = Role(
        "sums of forces on the table, friction levels, dampings and masses, by time",
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
    FORCE_OF_OTHER_AXIS = Role(
        "sums of forces on the table and of masses, by the motion of another axis",
        (("force_n", "p s position_m velocity_m_s"), ("added_kg", "p s")),
    )
    MASS = Role("moved mass", (("added_kg", "p"),))
    FRICTION_LEVEL = Role("sum of friction levels", (("level_n", "p speed_m_s"),))
    FRICTION_SPEED = Role("sum of friction levels, by the velocity", (("level_n", "p velocity_m_s"),))
    FRICTION_LOAD = Role(
        "sum of friction levels, by the transmitted force", (("level_n", "p transmitted_n friction_n"),)
    )
    FRICTION_POSITION = Role("sum of friction levels, by the position", (("level_n", "p position_m"),))
    FRICTION_DWELL = Role(
        "sum of friction levels, by the dwell time", (("level_n", "p s"), ("slide", "p s velocity_m_s dt_s"))
    )
    FRICTION_DIRECTION = Role("sum of friction levels, by the direction", (("level_n", "p direction"),))
    DAMPING = Role("sum of dampings", (("damping_n_s_m", "p velocity_m_s"),))
    FRICTION_CHANGE = Role(
        "factors on friction levels and damping", (("factors", "p s time_s"),), _HEAT_AND_WEAR
    )
    PRESLIDING = Role("contact that turns the sum of the levels into a force; one an axis", _CONTACT)
    PRESLIDING_LEVEL = Role("contact that adds a level of its own", _CONTACT)
    POSITION_ERROR = Role(
        "sum of errors between screw and table",
        (*_ERROR, ("slope", "p s position_m turn_rad_m")),
        _HEAT_AND_WEAR,
    )
    COUPLING = Role("spring between two masses", (("force_n", "p deflection_m rate_m_s"),))
    GAP = Role("gap in front of a spring", (("deflection_m", "p gap_m"),))
    SENSOR = Role("position to counts", (("counts", "p position_m"),))
    ENCODER_READING = Role("sum of errors of the motor encoder", _ERROR)
    SCALE_READING = Role("sum of errors of the scale", _ERROR)
    CROSS_READING = Role("error of the scale by another axis", (("error_m", "p s"),))
