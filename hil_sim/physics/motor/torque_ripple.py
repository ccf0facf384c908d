"""Torque ripple: the force per current varies with the angle of the screw.

Law: F = Kf i (1 + sum_k A_k sin(n_k phi + p_k)).
Source: mismatch catalogue, entry torque_ripple; harmonics of flux and winding and errors of commutation,
    Jahns and Soong (1996).
Symbols: F motor force N; i current A; Kf force constant N/A; phi = x `turn_rad_m` angle of the screw rad; n_k
    `harmonic` periods per turn; A_k `amplitude` as a share; p_k `phase_rad` rad.
Valid: field-oriented current, below saturation.
Confused with: cogging, which also acts without current -> repeat with another load;
    position_dependent_friction.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FORCE_SHARE
TERMS = 6
LIST_ENDS_AT = "amplitude"


class Params(NamedTuple):
    """Up to six harmonics; the list ends at the first amplitude of zero."""

    harmonic: Annotated[tuple[float, ...], Quantity("", 0.0, 1e4, "periods per turn n_k", length=TERMS)]
    amplitude: Annotated[tuple[float, ...], Quantity("", -0.5, 0.5, "amplitude A_k, a share", length=TERMS)]
    phase_rad: Annotated[tuple[float, ...], Quantity("rad", -7.0, 7.0, "phase p_k", "deg", length=TERMS)]


NEUTRAL = Params(harmonic=(1.0,) * TERMS, amplitude=(0.0,) * TERMS, phase_rad=(0.0,) * TERMS)


@kernel
def share(p: Any, position_m: float, turn_rad_m: float) -> float:
    """Return the relative change of the force at a motor position (m)."""
    more = 0.0
    turn_rad = position_m * turn_rad_m
    for k in range(TERMS):
        if p.amplitude[k] == 0.0:
            break
        more += p.amplitude[k] * math.sin(p.harmonic[k] * turn_rad + p.phase_rad[k])
    return more
