"""Notch filter in the set point of the amplifier: the force in cst, the velocity in csv.

    N(s) = (s^2 + 2 d z w s + w^2) / (s^2 + 2 z w s + w^2),   w = 2 pi f

At f the gain is d, far from f it is 1; z is half the relative width of the stop band. Against a structural
resonance at f, it reduces the loop gain there to d, so that the loop may be faster; below f it costs phase.
Source: textbooks on filters; the bilinear transform is prewarped at f (Oppenheim and Schafer,
Discrete-Time Signal Processing, section 7.2), so that the notch lies at f whatever the period.

It acts after the control law and before the limit: integrals, feedforward and observer pass through it.
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from kernels.jit import kernel
from kernels.quantities import Quantity
from servo_ctrl.control.section import AxisFacts, Key, LawSection, Need


@dataclass(frozen=True, kw_only=True)
class NotchSettings:
    """Takes one frequency out of the set point that the amplifier gets; cst and csv."""

    enabled: Annotated[bool, Key("Whether it acts.")] = True
    frequency_hz: Annotated[
        float, Key("Frequency that it takes out, hertz, below half the SYNC rate.", above=0.0)
    ]
    damping_ratio: Annotated[
        float, Key("Of its poles: half the relative width of what it takes out.", above=0.0, at_most=2.0)
    ] = 0.5
    depth: Annotated[
        float, Key("What is left at that frequency: 0 nothing, 1 everything.", at_least=0.0, at_most=1.0)
    ] = 0.1


class Params(NamedTuple):
    """A biquad whose first denominator coefficient is 1; its gain at 0 Hz is 1."""

    enabled: bool
    b0: Annotated[float, Quantity("", -math.inf, math.inf, "of the present value")]
    b1: Annotated[float, Quantity("", -math.inf, math.inf, "of the value before; a1 too")]
    b2: Annotated[float, Quantity("", -math.inf, math.inf, "of the second one before")]
    a2: Annotated[float, Quantity("", -1.0, 1.0, "of the second output before")]


class State(NamedTuple):
    """Transposed direct form II: contributions of past values to this output and the next, N or m/s."""

    next_output: float
    second_output: float


NEUTRAL = Params(enabled=False, b0=1.0, b1=0.0, b2=0.0, a2=0.0)


def params_of(settings: NotchSettings, axis: AxisFacts) -> Params:
    """The coefficients at the SYNC period."""
    return biquad(
        float(settings.frequency_hz),
        float(settings.damping_ratio),
        float(settings.depth),
        axis.period_s,
        enabled=settings.enabled,
    )


def biquad(
    frequency_hz: float, damping_ratio: float, depth: float, period_s: float, *, enabled: bool = True
) -> Params:
    """The notch in z: s = w / tan(w T / 2) (z - 1) / (z + 1). `frequency_hz` is below half the rate."""
    k = math.tan(math.pi * frequency_hz * period_s)
    poles, zeros = 2.0 * damping_ratio * k, 2.0 * damping_ratio * depth * k
    a0 = 1.0 + poles + k * k
    return Params(
        enabled=enabled,
        b0=(1.0 + zeros + k * k) / a0,
        b1=2.0 * (k * k - 1.0) / a0,
        b2=(1.0 - zeros + k * k) / a0,
        a2=(1.0 - poles + k * k) / a0,
    )


def too_fast(settings: NotchSettings, period_s: float) -> str:
    """Say why the SYNC rate is too low for this frequency, or return ""."""
    highest_hz = 0.5 / period_s
    if settings.frequency_hz < highest_hz:
        return ""
    return f"frequency_hz: {settings.frequency_hz:g} Hz is not below half the SYNC rate, {highest_hz:g} Hz"


SECTION = LawSection(
    name="notch",
    meaning="Notch filter against a resonance.",
    settings=NotchSettings,
    params=params_of,
    neutral=NEUTRAL,
    needs=(Need.VELOCITY_SET_POINT,),
    period_objection=too_fast,
)


@kernel
def at_rest() -> State:
    """State before the first value."""
    return State(next_output=0.0, second_output=0.0)


@kernel
def notched(p: Params, state: State, value: float) -> tuple[float, State]:
    """The filtered set point (N or m/s) and the next state; disabled, the set point unchanged."""
    if not p.enabled:
        return value, state
    output = p.b0 * value + state.next_output
    following = p.b1 * (value - output) + state.second_output
    return output, State(following, p.b2 * value - p.a2 * output)
