"""Relaxation: a spring in series with a damper beside the axis: a hose, a cover, an elastomer.

Law: F = -c u,  tau du/dt = v - u. For slow motion it is a damper c, for fast motion a spring c / tau; at rest
    its force decays with tau.
Source: Maxwell's element (1867).
Symbols: F force on the table N; c `damping_n_s_m` N s/m; u `damper_m_s` rate of the damper m/s; v velocity
    m/s; tau `time_s` s, damping over stiffness.
Valid: small deflections; one of possibly several time constants.
Confused with: viscous_friction, its slow limit -> the force after a stop; drive_compliance -> rings, because
    its damping is low.
"""

import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.MEMORY_FORCE


class Params(NamedTuple):
    """Damping, and time constant of the relaxation."""

    damping_n_s_m: Annotated[float, Quantity("N s/m", -1e5, 1e5, "damping c")]
    time_s: Annotated[float, Quantity("s", 1e-3, 1e4, "time constant tau")]


class State(NamedTuple):
    """Rate of the damper (m/s)."""

    damper_m_s: float = 0.0


NEUTRAL = Params(damping_n_s_m=0.0, time_s=0.1)


def problems(p: Params, axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless the substep resolves the spring's stiffness."""
    if abs(p.damping_n_s_m) / p.time_s * axis.dt_s**2 > axis.moved_kg:
        yield "", "too stiff for the table at this substep"


@kernel
def force_n(p: Any, s: Any) -> float:
    """Return the force on the table (N)."""
    return float(-p.damping_n_s_m * s.damper_m_s)


@kernel
def advance(p: Any, s: Any, velocity_m_s: float, dt_s: float) -> None:
    """Advance the rate of the damper by `dt_s` at constant velocity; exact for any step."""
    decay = math.exp(-dt_s / p.time_s)
    s.damper_m_s = velocity_m_s + (s.damper_m_s - velocity_m_s) * decay
