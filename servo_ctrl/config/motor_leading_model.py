"""controller.toml as types: what leads the motor beside the command."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Strict

from servo_ctrl.config.section import Positive, Section


class ScrewCompensationConfig(Section):
    """Screw-error table and backlash take-up, learned from scale against encoder."""

    enabled: bool = True
    """Whether it acts from the start, once something has been learned."""
    step_mm: Positive | None = None
    """Largest distance of the table's nodes, millimetres; without it, a sixteenth of the lead."""
    travels: Annotated[int, Strict(), Field(ge=2, le=100)] = 3
    """So many travels, there and back, are learned from."""
    feed_mm_min: Positive = 1000.0
    """Speed of the travels, mm/min."""
    dwell_s: Annotated[float, Strict(), Field(gt=0.0, le=60.0)] = 0.5
    """Rest at the ends of a travel, seconds."""
    limit_um: Positive = 200.0
    """A correction that would be larger is not learned, and not used, micrometres."""
    take_up_acceleration_mm_s2: Positive = 500.0
    """Acceleration with which the lost motion is taken up after a reversal, mm/s^2."""
    take_up_jerk_mm_s3: Positive = 50_000.0
    """Likewise its jerk, mm/s^3."""


class SampledDualLoopConfig(Section):
    """The scale is read at the end point, and the deviation commanded afterwards (Wang et al. 2014)."""

    enabled: bool = True
    """Whether it acts."""
    settle_ms: Positive = 100.0
    """Rest of the command, and of each correction, before the scale is read, milliseconds."""
    tolerance_um: Positive = 0.5
    """A deviation up to this is left, micrometres."""
    corrections: Annotated[int, Strict(), Field(ge=1, le=100)] = 3
    """So many at one end point, at most."""
    limit_um: Positive = 100.0
    """Bound of the correction, micrometres."""
    profile: Literal["s_curve", "trapezoidal"] = "s_curve"
    """How a correction is moved: five-phase S curve, or trapezoidal velocity."""
    acceleration_mm_s2: Positive | None = None
    """Of the corrections, mm/s^2; without it, that of the limits."""
    jerk_mm_s3: Positive | None = None
    """Of the corrections, mm/s^3; without it, that of the limits."""
