"""Voltage saturation: at speed the back-EMF leaves less voltage for the current.

Law: i' = i limited to (-Umax - Ke v) / R and (Umax - Ke v) / R, so that u = R i + Ke v stays within +-Umax.
Source: mismatch catalogue, entry voltage_saturation, u <= Umax - Ke v; Xia et al., equation (1) at rest.
Symbols: i commanded current, which the amplifier reports, A; i' force-producing current A; Umax
    `voltage_limit_v` V; R `resistance_v_a` V/A; Ke v back-EMF V, Ke the force constant.
Valid: without the winding's inductance; with `winding` the amplifier's voltage limit has this effect.
Confused with: torque_constant_saturation -> a high force at low speed shows only that effect.
"""

from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.CURRENT_PATH
ORDER = 2  # the supply


class Params(NamedTuple):
    """Largest voltage, and winding resistance."""

    voltage_limit_v: Annotated[float, Quantity("V", 1.0, 1e6, "largest voltage Umax")]
    resistance_v_a: Annotated[float, Quantity("V/A", 1e-3, 1e3, "winding resistance R", "ohm")]


NEUTRAL = Params(voltage_limit_v=1e6, resistance_v_a=1e-3)


def problems(_p: Params, axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem with a modelled winding, which has its own limit."""
    if "winding" in axis.effects:
        yield "", "winding has the amplifier's voltage_limit_v: remove one of the two"


@kernel
def force_producing_a(p: Any, current: float, back_emf_v: float, _dt_s: float) -> float:
    """Return the force-producing current (A) within the limits of the voltage."""
    lowest = (-p.voltage_limit_v - back_emf_v) / p.resistance_v_a
    highest = (p.voltage_limit_v - back_emf_v) / p.resistance_v_a
    return float(max(lowest, min(highest, current)))
