"""Sampled dual loop: the scale is read at the end point, and the deviation is then added to the command.

    dL = x* - x_scale, after the command has settled;   x_motor = x* + gain sum dL

Source: Wang et al. 2014, section 2.

The correction is repeated until |dL| is within the tolerance, at most as often as set. It works with any
backlash and cannot oscillate, because the scale closes no loop during motion. The correction stays in force,
so the next end point starts with the error of this one; switched off, it returns to 0 by a motion of its own.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

from kernels.jit import kernel
from kernels.quantities import Quantity
from servo_ctrl.control.compensation.trapezoidal_pulse import REST_M
from servo_ctrl.control.limits import clamp
from servo_ctrl.control.offset_motion import OffsetMotion, advanced, over, rest_to_rest, resting
from servo_ctrl.control.section import AxisFacts, Key, LawSection, Need
from servo_ctrl.units import MM, UM


@dataclass(frozen=True, kw_only=True)
class SampledDualLoopSettings:
    """The scale is read at the end point, and the deviation commanded afterwards (Wang et al. 2014)."""

    enabled: Annotated[bool, Key("Whether it acts.")] = True
    settle_ms: Annotated[
        float,
        Key(
            "Rest of the command, and of each correction, before the scale is read, milliseconds.", above=0.0
        ),
    ] = 100.0
    tolerance_um: Annotated[float, Key("A deviation up to this is left, micrometres.", above=0.0)] = 0.5
    corrections: Annotated[int, Key("Most corrections at one end point.", at_least=1, at_most=100)] = 3
    gain: Annotated[
        float,
        Key(
            "Share of the deviation that one correction takes; beside a learned screw table a small one, "
            "once an end point, follows warmth and leaves the play alone.",
            above=0.0,
            at_most=1.0,
        ),
    ] = 1.0
    limit_um: Annotated[float, Key("Bound of the correction, micrometres.", above=0.0)] = 100.0
    profile: Annotated[
        Literal["s_curve", "trapezoidal"],
        Key("How a correction is moved: five-phase S curve, or trapezoidal velocity."),
    ] = "s_curve"
    acceleration_mm_s2: Annotated[
        float | None, Key("Of the corrections, mm/s^2; without it, that of the limits.", above=0.0)
    ] = None
    jerk_mm_s3: Annotated[
        float | None, Key("Of the corrections, mm/s^3; without it, that of the limits.", above=0.0)
    ] = None


class Params(NamedTuple):
    """When the scale is read, and how a correction is moved."""

    enabled: bool
    settle_s: Annotated[float, Quantity("s", 0.0, math.inf, "rest before the scale is read")]
    tolerance_m: Annotated[float, Quantity("m", 0.0, math.inf, "deviation that is left")]
    corrections: Annotated[int, Quantity("", 0.0, 100.0, "most corrections at one end point")]
    limit_m: Annotated[float, Quantity("m", 0.0, math.inf, "bound of the correction")]
    smooth: bool
    """Corrections by a five-phase S curve; else trapezoidal."""
    acceleration_m_s2: Annotated[float, Quantity("m/s2", 0.0, math.inf, "of a correction, > 0")]
    jerk_m_s3: Annotated[float, Quantity("m/s3", 0.0, math.inf, "of a correction, > 0")]
    gain: Annotated[float, Quantity("", 0.0, 1.0, "share of the deviation that a correction takes")]


class State(NamedTuple):
    """State of the sampled dual loop."""

    rest_s: float
    """Time since command and correction came to rest."""
    corrections: int
    """Number made at this end point; the most allowed once the deviation is within the tolerance."""
    motion: OffsetMotion


NEUTRAL = Params(
    enabled=False,
    settle_s=1.0,
    tolerance_m=0.0,
    corrections=0,
    limit_m=0.0,
    smooth=True,
    acceleration_m_s2=1.0,
    jerk_m_s3=1.0,
    gain=1.0,
)


def params_of(settings: SampledDualLoopSettings, axis: AxisFacts) -> Params:
    """The parameters of the tick."""
    acceleration_mm_s2, jerk_mm_s3 = settings.acceleration_mm_s2, settings.jerk_mm_s3
    return Params(
        enabled=settings.enabled,
        settle_s=float(settings.settle_ms) * 1e-3,
        tolerance_m=float(settings.tolerance_um) * UM,
        corrections=int(settings.corrections),
        limit_m=float(settings.limit_um) * UM,
        smooth=settings.profile == "s_curve",
        acceleration_m_s2=float(acceleration_mm_s2) * MM if acceleration_mm_s2 else axis.acceleration_m_s2,
        jerk_m_s3=float(jerk_mm_s3) * MM if jerk_mm_s3 else axis.jerk_m_s3,
        gain=float(settings.gain),
    )


def objection(settings: SampledDualLoopSettings, resolution_um: float) -> str:
    """Say why no correction could meet the tolerance, or return ""."""
    half_um, tolerance_um = 0.5 * resolution_um, settings.tolerance_um
    if tolerance_um < half_um:
        return (
            f"tolerance_um: {tolerance_um:g} is less than half a count of the scale ({half_um:g}); "
            "no correction could ever meet it"
        )
    if settings.limit_um < tolerance_um:
        return (
            f"limit_um: {settings.limit_um:g} is less than tolerance_um {tolerance_um:g}; "
            "nothing could ever be corrected"
        )
    return ""


SECTION = LawSection(
    name="sampled_dual_loop",
    meaning="The scale read at the end point.",
    settings=SampledDualLoopSettings,
    params=params_of,
    neutral=NEUTRAL,
    needs=(Need.SCALE, Need.MOTOR_LED),
    objection=objection,
)


@kernel
def at_rest() -> State:
    """State before the first correction."""
    return State(rest_s=0.0, corrections=0, motion=resting())


@kernel
def advance_sampled(p: Params, state: State, deviation_m: float, moving: bool, period_s: float) -> State:
    """State one period later. `deviation_m`: x* - x_scale; without a reading (NaN) the correction waits."""
    motion = advanced(state.motion, period_s)
    if not p.enabled and over(motion) and motion.to_m != 0.0:
        motion = rest_to_rest(motion.to_m, 0.0, p.smooth, p.acceleration_m_s2, p.jerk_m_s3)
    if not p.enabled or moving:
        return State(0.0, 0, motion)
    if not over(motion):
        return State(0.0, state.corrections, motion)
    rest_s = state.rest_s + period_s
    if rest_s < p.settle_s or state.corrections >= p.corrections or not math.isfinite(deviation_m):
        return State(rest_s, state.corrections, motion)
    if abs(deviation_m) <= p.tolerance_m + REST_M:  # rounding must not look like a deviation
        return State(rest_s, p.corrections, motion)
    wanted_m = clamp(motion.to_m + p.gain * deviation_m, p.limit_m)
    motion = rest_to_rest(motion.to_m, wanted_m, p.smooth, p.acceleration_m_s2, p.jerk_m_s3)
    return State(0.0, state.corrections + 1, motion)
