"""Temperature-dependent friction: friction heats the lubricant, thins it and falls.

Law: f = w + (1 - w) exp(-T / T0), with one w for the levels and one for the damping;  C dT/dt = P - T / R.
Source: Bittencourt, Wernholt, Sander-Tavallaey, Brogardh (2010), a constant and an exponentially falling
    part, after the viscosity law of Reynolds (1886); the lumped heat balance is Newton's law of cooling.
Symbols: f factor on friction; T `temperature_rise_k` excess temperature of the lubricant over its
    surroundings K; T0 `warmth_scale_k` K; w `warm_level_share` and `warm_damping_share`, ratios of hot
    to cold friction, above 1 where friction rises; C `heat_capacity_j_k` J/K; R `resistance_k_w`
    K/W; P friction power W.
Valid: one temperature of all lubricant, cold at power-up, far below its boiling point.
Confused with: friction_ageing, also a drift with use -> let the axis cool and repeat: wear stays;
    lubrication_loss -> continues at rest.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FRICTION_CHANGE
NEEDS = "coulomb_friction"
ORDER = 1  # place in the product of the factors


class Params(NamedTuple):
    """Friction of the hot axis, and the parameters of its heating."""

    warm_level_share: Annotated[float, Quantity("", 0.0, 20.0, "ratio w of hot to cold friction levels")]
    warm_damping_share: Annotated[float, Quantity("", 0.0, 20.0, "ratio w of hot to cold viscous damping")]
    warmth_scale_k: Annotated[float, Quantity("K", 0.1, 200.0, "excess temperature T0 of 63 % of the change")]
    heat_capacity_j_k: Annotated[float, Quantity("J/K", 1.0, 1e6, "heat capacity C of what friction heats")]
    resistance_k_w: Annotated[float, Quantity("K/W", 1e-2, 1e3, "thermal resistance to the surroundings R")]


class State(NamedTuple):
    """Temperature of the lubricant above its surroundings (K), see the symbols."""

    temperature_rise_k: float = 0.0


NEUTRAL = Params(
    warm_level_share=1.0,
    warm_damping_share=1.0,
    warmth_scale_k=10.0,
    heat_capacity_j_k=1e3,
    resistance_k_w=1.0,
)


@kernel
def factors(p: Any, s: Any, _time_s: float) -> tuple[float, float]:
    """Return the factors on the friction levels and on the damping at the temperature of the lubricant."""
    cold = math.exp(-s.temperature_rise_k / p.warmth_scale_k)
    return (
        float(p.warm_level_share + (1.0 - p.warm_level_share) * cold),
        float(p.warm_damping_share + (1.0 - p.warm_damping_share) * cold),
    )


@kernel
def advance(p: Any, s: Any, friction_w: float, _speed_m_s: float, dt_s: float) -> None:
    """Advance the temperature by `dt_s` (s, far below R C) at constant friction power (W).

    The power that presliding springs store and return is not heat; it is neglected, and the rise stays >= 0.
    """
    flow_w = friction_w - s.temperature_rise_k / p.resistance_k_w
    s.temperature_rise_k = max(0.0, s.temperature_rise_k + flow_w * dt_s / p.heat_capacity_j_k)
