"""Friction compensation pulse on the velocity command: a trapezoid (Feng et al. 2015, section 2), or two.

    p(t) = s A clip(min(t / Tr, (T - t) / Tr), 0, 1),   t from the reversal t1, s the new direction

t1 is the sample at which the increment of the position command changes its sign; rests in between do not
count. The shape of the pulse is read at t1 from the learned functions, at the reverse acceleration of this
reversal, and is held until the next one.

The trailing pulse is ours: a second trapezoid, of either sign, that begins later. Friction falls when
presliding ends, and the force that the first pulse has built up then pushes the table ahead. Without it
(amplitude 0) the pulse is that of the paper.
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from kernels.jit import kernel
from kernels.quantities import Quantity
from kernels.record_layout import Table
from servo_ctrl.control.limits import clamp
from servo_ctrl.control.section import AxisFacts, Key, LawSection, Need
from servo_ctrl.control.table_lookup import place_of, value_at
from servo_ctrl.control.types import AxisSample
from servo_ctrl.units import MM

REST_M = 1e-12
"""Increments of the position command below this are rest: rounding must not look like a reversal."""


@dataclass(frozen=True, kw_only=True)
class FrictionCompensationSettings:
    """Pulse on the velocity command at every reversal; what it looks like is learned."""

    enabled: Annotated[bool, Key("Whether it acts from the start, once something has been learned.")] = True
    rise_ms: Annotated[float, Key("Rise time Tr, milliseconds.", above=0.0)] = 10.0
    acceleration_allowed_mm_s2: Annotated[
        float, Key("a_allow: the pulse stays below A_max = a_allow Tr.", above=0.0)
    ] = 200.0


class Params(NamedTuple):
    """Bounds of the pulse, and the learned functions."""

    enabled: bool
    rise_s: Annotated[float, Quantity("s", 0.0, math.inf, "rise time Tr, > 0")]
    amplitude_max_m_s: Annotated[float, Quantity("m/s", 0.0, math.inf, "A_max, whatever was learned")]
    learned: Table
    """(6, n), n >= 1: rising reverse accelerations, m/s^2; then the fields of `PulseShape`."""


class PulseShape(NamedTuple):
    """One friction compensation pulse."""

    duration_s: float
    """T."""
    amplitude_m_s: float
    """A, in the new direction."""
    trailing_start_s: float
    """From the reversal to the start of the second trapezoid."""
    trailing_duration_s: float
    trailing_amplitude_m_s: float
    """Of either sign; 0 without a second trapezoid."""


class State(NamedTuple):
    """State of the pulse."""

    position_command_m: float
    """Position command of the last sample."""
    direction: float
    """Direction of the last motion, +1 or -1; 0 before the first."""
    age_s: float
    """Time since the last reversal."""
    shape: PulseShape
    """Shape of the pulse that began at the last reversal."""


NEUTRAL = Params(enabled=False, rise_s=1.0, amplitude_max_m_s=0.0, learned=np.zeros((6, 1)))


def params_of(settings: FrictionCompensationSettings, _axis: AxisFacts) -> Params:
    """Parameters before anything is learned: off; `config.kernel_params.with_pulse` sets the functions."""
    rise_s = float(settings.rise_ms) * 1e-3
    return NEUTRAL._replace(
        rise_s=rise_s, amplitude_max_m_s=float(settings.acceleration_allowed_mm_s2) * MM * rise_s
    )


SECTION = LawSection(
    name="friction_compensation",
    meaning="Learned pulse at the reversals.",
    settings=FrictionCompensationSettings,
    params=params_of,
    neutral=NEUTRAL,
    needs=(Need.VELOCITY_SET_POINT,),
)


@kernel
def no_pulse() -> PulseShape:
    """A shape without either trapezoid."""
    return PulseShape(
        duration_s=0.0,
        amplitude_m_s=0.0,
        trailing_start_s=0.0,
        trailing_duration_s=0.0,
        trailing_amplitude_m_s=0.0,
    )


@kernel
def at_rest(position_command_m: float) -> State:
    """State before the first motion."""
    return State(position_command_m=position_command_m, direction=0.0, age_s=0.0, shape=no_pulse())


@kernel
def shape_at(learned: Table, reverse_m_s2: float) -> PulseShape:
    """The shape at a reverse acceleration: linear between the columns of `learned`, held outside."""
    place = place_of(learned, reverse_m_s2)
    return PulseShape(
        duration_s=value_at(learned, 1, place),
        amplitude_m_s=value_at(learned, 2, place),
        trailing_start_s=value_at(learned, 3, place),
        trailing_duration_s=value_at(learned, 4, place),
        trailing_amplitude_m_s=value_at(learned, 5, place),
    )


@kernel
def advance_pulse(p: Params, state: State, sample: AxisSample, period_s: float) -> State:
    """State one period later, at this sample; a reversal begins a new pulse unless disabled."""
    position_command_m = sample.position_command_m
    increment_m = position_command_m - state.position_command_m
    if abs(increment_m) < REST_M:
        return State(position_command_m, state.direction, state.age_s + period_s, state.shape)
    direction = 1.0 if increment_m > 0.0 else -1.0
    if direction * state.direction >= 0.0:
        return State(position_command_m, direction, state.age_s + period_s, state.shape)
    shape = no_pulse()
    if p.enabled:
        shape = shape_at(p.learned, abs(sample.acceleration_command_m_s2))
    return State(position_command_m, direction, 0.0, shape)


@kernel
def older_pulse(state: State, period_s: float) -> State:
    """State one period later, at a sample without a position command."""
    return State(state.position_command_m, state.direction, state.age_s + period_s, state.shape)


@kernel
def trapezoid(age_s: float, duration_s: float, rise_s: float) -> float:
    """clip(min(t / Tr, (T - t) / Tr), 0, 1): a triangle if T is less than two rise times."""
    return min(max(min(age_s, duration_s - age_s) / rise_s, 0.0), 1.0)


@kernel
def pulse_m_s(p: Params, state: State) -> float:
    """Velocity of the pulse, m/s, within +-A_max; 0 outside of the pulse."""
    shape = state.shape
    main_m_s = shape.amplitude_m_s * trapezoid(state.age_s, shape.duration_s, p.rise_s)
    trailing_m_s = shape.trailing_amplitude_m_s * trapezoid(
        state.age_s - shape.trailing_start_s, shape.trailing_duration_s, p.rise_s
    )
    return state.direction * clamp(main_m_s + trailing_m_s, p.amplitude_max_m_s)
