"""Thermal expansion: the screw expands with its temperature, away from its fixed bearing.

Law: e = alpha (T - T0) (x - x0);  C dT/dt = q P - (T - Ta) / R.
Source: mismatch catalogue, entry thermal_expansion, alpha L dT; the lumped heat balance is Newton's law of
    cooling.
Symbols: e table position minus nominal m; alpha `expansion_1_k` 1/K; T screw temperature K; T0 `reference_k`
    K, where the lead is nominal; x0 `fixed_end_m` m; C `heat_capacity_j_k` J/K; q `heat_share` of the
    friction power P W that goes into the screw; Ta `ambient_k` K; R `resistance_k_w` K/W; `start_k`
    temperature at power-up K.
Valid: one temperature for the whole screw, fixed at one end.
Confused with: lead_error_cumulative, the same shape -> thermal expansion drifts with the run time.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.POSITION_ERROR


class Params(NamedTuple):
    """Expansion and heat balance of the screw."""

    expansion_1_k: Annotated[float, Quantity("1/K", 0.0, 1e-4, "linear expansion alpha", "um/(m K)")]
    fixed_end_m: Annotated[float, Quantity("m", -10.0, 10.0, "position of the fixed bearing x0", "mm")]
    reference_k: Annotated[float, Quantity("K", 200.0, 400.0, "temperature of the nominal lead T0", "degC")]
    start_k: Annotated[float, Quantity("K", 200.0, 400.0, "temperature at power-up", "degC")]
    ambient_k: Annotated[float, Quantity("K", 233.15, 393.15, "temperature of the surroundings Ta", "degC")]
    heat_capacity_j_k: Annotated[float, Quantity("J/K", 1.0, 1e6, "heat capacity of the screw C")]
    resistance_k_w: Annotated[float, Quantity("K/W", 1e-2, 1e3, "thermal resistance to the surroundings R")]
    heat_share: Annotated[float, Quantity("", 0.0, 1.0, "share q of the friction power that heats the screw")]


class State(NamedTuple):
    """Temperature of the screw (K)."""

    temperature_k: float = 293.15


NEUTRAL = Params(
    expansion_1_k=0.0,
    fixed_end_m=0.0,
    reference_k=293.15,
    start_k=293.15,
    ambient_k=293.15,
    heat_capacity_j_k=1e3,
    resistance_k_w=1.0,
    heat_share=0.0,
)


def powered_up(p: Any) -> State:
    """Return the state of the screw at power-up."""
    return State(float(p["start_k"]))


@kernel
def error_m(p: Any, s: Any, position_m: float, _turn_rad_m: float) -> float:
    """Return the error of the table position (m)."""
    return float(p.expansion_1_k * (s.temperature_k - p.reference_k) * (position_m - p.fixed_end_m))


@kernel
def slope(p: Any, s: Any, _position_m: float, _turn_rad_m: float) -> float:
    """Return the derivative of the error by the position."""
    return float(p.expansion_1_k * (s.temperature_k - p.reference_k))


@kernel
def advance(p: Any, s: Any, friction_w: float, _speed_m_s: float, dt_s: float) -> None:
    """Advance the temperature by `dt_s` (s, far below R C) at constant friction power (W)."""
    flow_w = p.heat_share * friction_w - (s.temperature_k - p.ambient_k) / p.resistance_k_w
    s.temperature_k = s.temperature_k + flow_w * dt_s / p.heat_capacity_j_k
