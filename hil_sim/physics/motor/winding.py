"""Motor winding: resistance, inductance and back-EMF between amplifier voltage and current.

Law: u = L di/dt + R i + Ke v, solved exactly over a step of constant u and v:
    i(t + dt) = i_inf + (i - i_inf) exp(-R dt / L), i_inf = (u - Ke v) / R.
Source: Xia et al., equations (1) and (3); Ke acts on the motor's linear velocity, Ke = Kt 2 pi / lead
    (a lossless motor, equal constants in SI).
Symbols: u voltage V; i current A; L `inductance_h` H; R `resistance_v_a` V/A; Ke V s/m; v velocity m/s; dt s.
Valid: quadrature axis of a field-oriented permanent-magnet motor without saturation. Without the section the
    amplifier is an ideal current source.
Confused with: current_loop_lag, the behaviour of the closed current loop -> its lag shortens with the loop's
    gain; voltage_saturation -> only at high speed and force together.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.WINDING


class Params(NamedTuple):
    """Resistance and inductance of the equivalent direct-current motor."""

    resistance_v_a: Annotated[float, Quantity("V/A", 1e-3, 1e3, "winding resistance R", "ohm")]
    inductance_h: Annotated[float, Quantity("H", 1e-6, 1.0, "winding inductance L", "mH")]


NEUTRAL = None
"""No values remove a winding: without the section the current is the commanded one."""


@kernel
def decay(p: Any, dt_s: float) -> float:
    """Return the share of a current that is left after `dt_s` with the winding short-circuited."""
    return math.exp(-p.resistance_v_a * dt_s / p.inductance_h)


@kernel
def current_a(p: Any, current: float, voltage_v: float, back_emf_v: float, decay_of_step: float) -> float:
    """Return the current (A) after a step at constant voltage and back-EMF (V); exact for any dt R / L.

    `decay_of_step`: `decay` of the step's duration.
    """
    final = (voltage_v - back_emf_v) / p.resistance_v_a
    return float(final + (current - final) * decay_of_step)
