"""Cogging: the magnets align with the teeth, a force over position that is independent of the current.

Law: F = sum_k A_k sin(n_k phi + p_k).
Source: mismatch catalogue, entry cogging (sum A_k sin(k 2 pi x / lead + phase)); Fourier form of the detent
    torque of permanent-magnet motors, Hwang and Lieu (1994).
Symbols: F force on the motor side N; phi = x `turn_rad_m` angle of the screw rad; n_k `harmonic` periods
    per turn; A_k `amplitude_n` N; p_k `phase_rad` rad.
Valid: any speed and current. Small in motors with skewed magnets or a coreless winding.
Confused with: torque_ripple, which is proportional to the current -> repeat with a load;
    position_dependent_friction, which changes its sign with the direction of motion.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.MOTOR_FORCE
HARMONICS_MAX = 6
"""Bounds the number of harmonics, which is the length of the record; chosen."""
LIST_ENDS_AT = "amplitude_n"


class Params(NamedTuple):
    """Up to six harmonics; the list ends at the first amplitude of zero."""

    harmonic: Annotated[
        tuple[float, ...], Quantity("", 0.0, 1e4, "periods per turn n_k", length=HARMONICS_MAX)
    ]
    amplitude_n: Annotated[tuple[float, ...], Quantity("N", -1e3, 1e3, "amplitude A_k", length=HARMONICS_MAX)]
    phase_rad: Annotated[
        tuple[float, ...], Quantity("rad", -7.0, 7.0, "phase p_k", "deg", length=HARMONICS_MAX)
    ]


NEUTRAL = Params(
    harmonic=(1.0,) * HARMONICS_MAX, amplitude_n=(0.0,) * HARMONICS_MAX, phase_rad=(0.0,) * HARMONICS_MAX
)


@kernel
def force_n(p: Any, position_m: float, turn_rad_m: float) -> float:
    """Return the force on the motor side (N)."""
    force = 0.0
    turn_rad = position_m * turn_rad_m
    for k in range(HARMONICS_MAX):
        if p.amplitude_n[k] == 0.0:
            break
        force += p.amplitude_n[k] * math.sin(p.harmonic[k] * turn_rad + p.phase_rad[k])
    return force
