"""Torque ripple: the force per current varies with the angle of the screw.

Law: F = Kf i (1 + sum_k A_k sin(n_k phi + p_k)).
Source: mismatch catalogue, entry torque_ripple; harmonics of flux and winding and errors of commutation,
    Jahns and Soong (1996).
Symbols: F motor force N; i current A; Kf force constant N/A; phi = x `turn_rad_m` angle of the screw rad; n_k
    `harmonic` periods per turn; A_k `amplitude` relative to the force; p_k `phase_rad` rad.
Valid: field-oriented current, below saturation.
Confused with: cogging, which also acts without current -> repeat with another load;
    position_dependent_friction.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FORCE_RIPPLE
HARMONICS_MAX = 6
"""Bounds the number of harmonics, which is the length of the record; chosen."""
LIST_ENDS_AT = "amplitude"


class Params(NamedTuple):
    """Up to six harmonics; the list ends at the first amplitude of zero."""

    harmonic: Annotated[
        tuple[float, ...], Quantity("", 0.0, 1e4, "periods per turn n_k", length=HARMONICS_MAX)
    ]
    amplitude: Annotated[
        tuple[float, ...], Quantity("", -0.5, 0.5, "relative amplitude A_k", length=HARMONICS_MAX)
    ]
    phase_rad: Annotated[
        tuple[float, ...], Quantity("rad", -7.0, 7.0, "phase p_k", "deg", length=HARMONICS_MAX)
    ]


NEUTRAL = Params(
    harmonic=(1.0,) * HARMONICS_MAX, amplitude=(0.0,) * HARMONICS_MAX, phase_rad=(0.0,) * HARMONICS_MAX
)


@kernel
def relative_ripple(p: Any, position_m: float, turn_rad_m: float) -> float:
    """Return the relative change of the force at a motor position (m)."""
    ripple = 0.0
    turn_rad = position_m * turn_rad_m
    for k in range(HARMONICS_MAX):
        if p.amplitude[k] == 0.0:
            break
        ripple += p.amplitude[k] * math.sin(p.harmonic[k] * turn_rad + p.phase_rad[k])
    return ripple
