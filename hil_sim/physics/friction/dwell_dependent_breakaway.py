"""Dwell-dependent breakaway: the breakaway force rises with the time at rest.

Law: level += D a;  da/dt = (1 - a) / tau - |v| a / d. At rest a = 1 - exp(-t / tau), so that the breakaway
    force is Fs_inf - D exp(-t / tau); motion removes the rise over the travel d.
Source: mismatch catalogue, entry dwell_dependent_breakaway; ageing and slip of the contact, Dieterich (1979)
    and Ruina (1983); in machines, Armstrong-Helouvry, Dupont, Canudas de Wit (1994), the rising static
    friction.
Symbols: D `growth_n` N; a age of the contact, 0 fresh to 1; tau `time_s` s; d `way_m` m; v velocity m/s; t
    time at rest s.
Valid: boundary lubrication, dwell of 0.1 to 1000 s. At power-up a = 1, as after a long dwell.
Confused with: temperature_dependent_friction, also more friction after a pause -> vary only the dwell;
    stribeck_friction, a bump at low speeds that does not depend on the dwell -> vary the dwell.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FRICTION_DWELL
NEEDS = "coulomb_friction"


class Params(NamedTuple):
    """Growth of the breakaway force, and time and distance of its rise and decay."""

    growth_n: Annotated[float, Quantity("N", 0.0, 1e4, "growth D of the breakaway force")]
    time_s: Annotated[float, Quantity("s", 1e-3, 1e5, "time constant tau of the rise at rest")]
    way_m: Annotated[float, Quantity("m", 1e-8, 1e-2, "travel d over which it decays", "um")]


class State(NamedTuple):
    """Age of the contact, 0 to 1; 1 at power-up, as after a long dwell."""

    contact_age: float = 1.0


NEUTRAL = Params(growth_n=0.0, time_s=1.0, way_m=1e-5)


@kernel
def level_n(p: Any, s: Any) -> float:
    """Return the addition to the friction level (N) at the contact's age `s.contact_age`."""
    return float(p.growth_n * s.contact_age)


@kernel
def slide(p: Any, s: Any, velocity_m_s: float, dt_s: float) -> None:
    """Advance the age of the contact by `dt_s` (s) at constant velocity; exact for any step."""
    rate_1_s = 1.0 / p.time_s + abs(velocity_m_s) / p.way_m
    steady = 1.0 / (p.time_s * rate_1_s)
    s.contact_age = steady + (s.contact_age - steady) * math.exp(-rate_1_s * dt_s)
