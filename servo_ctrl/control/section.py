"""How a part of the control law declares its section of the machine file: plain data, without a parser.

`servo_ctrl.config` derives the check of the file, the tables of the documentation and the parameters of the
tick from it. Settings have the units of the file (mm, ms), parameters are SI.
"""

import math
from collections.abc import Callable
from enum import Enum
from typing import Any, NamedTuple


class Key(NamedTuple):
    """Annotation of a key: its meaning, and the bounds of its number."""

    meaning: str
    above: float | None = None
    at_least: float | None = None
    at_most: float | None = None


class Need(Enum):
    """What an axis must have for a compensation to act."""

    VELOCITY_SET_POINT = "the velocity set point is ours: cst or csv"
    FORCE_SET_POINT = "the force set point is ours: cst"
    MEASURED_CURRENT = "the drive sends its current"
    SCALE = "a scale"
    MOTOR_LED = "the motor may be led beside the command: csp, or a position loop on the motor"


class AxisFacts(NamedTuple):
    """Properties of the axis from which a part computes its parameters."""

    period_s: float
    acceleration_m_s2: float
    """Acceleration limit of programs."""
    jerk_m_s3: float
    """Jerk limit of programs."""


class LawSection(NamedTuple):
    """The section `[axis.NAME.<name>]`, or those of its keys that one part reads."""

    name: str
    meaning: str
    settings: type[Any]
    """A dataclass; each field is annotated with a `Key`."""
    params: Callable[[Any, AxisFacts], Any]
    """The parameters of the tick from the settings."""
    neutral: Any
    """The parameters if the section is missing: the part changes nothing."""
    needs: tuple[Need, ...] = ()
    objection: Callable[[Any, float], str] | None = None
    """Says why settings contradict each other or the scale's resolution (um, NaN without one); else ""."""
    period_objection: Callable[[Any, float], str] | None = None
    """Says why settings do not fit the SYNC period (s); else ""."""


def filter_blend(time_constant_s: float, period_s: float) -> float:
    """Share of the new value in a low pass that equals 1 / (1 + s tau) at the samples; 1 for tau = 0."""
    return 1.0 if time_constant_s == 0.0 else -math.expm1(-period_s / time_constant_s)
