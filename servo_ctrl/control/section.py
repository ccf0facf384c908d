"""What a part of the control law declares of its section in the machine file: plain data, without a parser.

`servo_ctrl.config` derives the check of the file, the tables of the documents and the parameters of the tick
from it. The settings are as the file has them (mm, ms), the parameters are SI.
"""

import math
from collections.abc import Callable
from enum import Enum
from typing import Any, NamedTuple


class Key(NamedTuple):
    """A key of the file: what it means, and the bounds of its number."""

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
    """Properties of the axis from which a part makes its parameters."""

    period_s: float
    acceleration_m_s2: float
    """Limit of programs."""
    jerk_m_s3: float
    """Likewise."""


class LawSection(NamedTuple):
    """The section `[axis.NAME.<name>]`, or those of its keys that this part reads."""

    name: str
    meaning: str
    settings: type[Any]
    """A dataclass; each field is annotated with a `Key`."""
    params: Callable[[Any, AxisFacts], Any]
    """The parameters of the tick from the settings."""
    neutral: Any
    """The parameters where the section is missing: nothing changes."""
    needs: tuple[Need, ...] = ()
    objection: Callable[[Any, float], str] | None = None
    """Why settings contradict each other, or the resolution of the scale (um, NaN without one), or ""."""
    period_objection: Callable[[Any, float], str] | None = None
    """Why settings do not go with the SYNC period (s), or ""."""


def filter_blend(time_constant_s: float, period_s: float) -> float:
    """Share of the new value in a low pass that matches 1 / (1 + s tau) at the samples; 1 for tau = 0."""
    return 1.0 if time_constant_s == 0.0 else -math.expm1(-period_s / time_constant_s)
