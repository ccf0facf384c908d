"""Disturbance observer: force that the nominal model cannot account for (Feng et al. 2015, section 2).

    d = Q [ u - (M a + B v) ],   added to the force command

u is the measured force (current times force constant), a and v come from the motor encoder, and Q is a
first-order low pass. The inverse of the nominal model needs M a + B v; the force beyond it balances friction
and all other disturbances.

a[k] = (v[k] - v[k-1]) / T spans the last two periods, and so does the mean of the last two currents.

The first velocity after a gap spans the gap, so it is not used: NaN in the state marks such values.
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from kernels.jit import kernel
from kernels.quantities import Quantity
from servo_ctrl.control.section import AxisFacts, Key, LawSection, Need, filter_blend


@dataclass(frozen=True, kw_only=True)
class DisturbanceObserverSettings:
    """Adds to the force what the nominal model cannot account for; needs `current_actual_value` in tpdo1."""

    enabled: Annotated[bool, Key("Whether it acts from the start.")] = False
    bandwidth_hz: Annotated[float, Key("Corner of its first-order low pass, hertz.", above=0.0)] = 3.0
    mass_kg: Annotated[float, Key("Moved mass of the nominal model, kg.", above=0.0)]
    viscous_n_s_m: Annotated[float, Key("Viscous friction of the nominal model, N s/m.", at_least=0.0)] = 0.0


class Params(NamedTuple):
    """Nominal model and low pass."""

    enabled: bool
    mass_kg: Annotated[float, Quantity("kg", 0.0, math.inf, "moved mass")]
    viscous_n_s_m: Annotated[float, Quantity("N s/m", 0.0, math.inf, "viscous friction")]
    filter_blend: Annotated[float, Quantity("", 0.0, 1.0, "share of the new value in the low pass, > 0")]


class State(NamedTuple):
    """State of the observer."""

    disturbance_n: float
    velocity_m_s: float
    """Velocity of the last sample; NaN after a bad one."""
    motor_force_n: float
    """Force of the last sample; NaN before the first, and where it must not be used."""


NEUTRAL = Params(enabled=False, mass_kg=0.0, viscous_n_s_m=0.0, filter_blend=1.0)


def params_of(settings: DisturbanceObserverSettings, axis: AxisFacts) -> Params:
    """The parameters of the tick."""
    return Params(
        enabled=settings.enabled,
        mass_kg=float(settings.mass_kg),
        viscous_n_s_m=float(settings.viscous_n_s_m),
        filter_blend=filter_blend(1.0 / (2.0 * math.pi * float(settings.bandwidth_hz)), axis.period_s),
    )


SECTION = LawSection(
    name="disturbance_observer",
    meaning="Observer of what the nominal model leaves out.",
    settings=DisturbanceObserverSettings,
    params=params_of,
    neutral=NEUTRAL,
    needs=(Need.FORCE_SET_POINT, Need.MEASURED_CURRENT),
)


@kernel
def at_rest() -> State:
    """State before the first sample."""
    return State(disturbance_n=0.0, velocity_m_s=0.0, motor_force_n=math.nan)


@kernel
def after_bad_sample(state: State) -> State:
    """State after a bad sample: the estimate is held until two complete samples have arrived."""
    return State(disturbance_n=state.disturbance_n, velocity_m_s=math.nan, motor_force_n=math.nan)


@kernel
def observed_disturbance(
    p: Params, state: State, motor_force_n: float, velocity_m_s: float, period_s: float
) -> State:
    """State one period later; the estimate is held while the force is absent or the velocity spans a gap."""
    if not p.enabled or not math.isfinite(motor_force_n):
        return State(0.0 if not p.enabled else state.disturbance_n, velocity_m_s, motor_force_n)
    if not math.isfinite(state.velocity_m_s):
        return State(state.disturbance_n, velocity_m_s, math.nan)
    if not math.isfinite(state.motor_force_n):
        return State(state.disturbance_n, velocity_m_s, motor_force_n)
    force_n = 0.5 * (motor_force_n + state.motor_force_n)
    middle_m_s = 0.5 * (velocity_m_s + state.velocity_m_s)
    model_n = p.mass_kg * (velocity_m_s - state.velocity_m_s) / period_s + p.viscous_n_s_m * middle_m_s
    disturbance_n = state.disturbance_n + p.filter_blend * (force_n - model_n - state.disturbance_n)
    return State(disturbance_n, velocity_m_s, motor_force_n)
