"""Shows the axes of a plant to each other: what an effect of the kind FORCE_OF_OTHER_AXIS follows.

The accelerations are those of the substep that has just ended. So both axes of a pair are advanced with what
the other did one substep before (the method of Jacobi), which converges as long as the kinetic energy of the
pair is positive for all velocities.
"""

from typing import Any

from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import of_kind
from kernels.jit import kernel
from kernels.unrolled import unrolled

FORCES_OF_OTHER_AXIS = of_kind(Kind.FORCE_OF_OTHER_AXIS)


@kernel
@unrolled
def _follows_another(p: Any) -> bool:
    count = 0
    for effect in FORCES_OF_OTHER_AXIS:
        count += p[effect].enabled
    return count > 0


@kernel
def any_force_of_another(params: Any) -> bool:
    """Return whether any axis of the plant (axes, AXIS_PARAMS) feels another."""
    count = 0
    for axis in range(len(params)):
        count += _follows_another(params[axis])
    return count > 0


@kernel
@unrolled
def see_other_axes(params: Any, state: Any, dt_s: float) -> None:
    """Write the motion of the last substep of `dt_s` (s) to the axes (axes, AXIS_STATE) that follow it."""
    for axis in range(len(params)):
        p, s = params[axis], state[axis]
        for effect in FORCES_OF_OTHER_AXIS:
            if p[effect].enabled:
                other = state[int(p[effect].other)]
                see(s[effect], other.table_position_m, other.table_velocity_m_s, dt_s)


@kernel
def see(seen: Any, position_m: float, velocity_m_s: float, dt_s: float) -> None:
    """Write position (m), velocity (m/s) and, from its change, the acceleration to an `OtherAxis`."""
    seen.acceleration_m_s2 = (velocity_m_s - seen.velocity_m_s) / dt_s
    seen.position_m, seen.velocity_m_s = position_m, velocity_m_s
