"""Eccentricity of the motor encoder: an off-centre disc causes a reading error of one period per turn.

Law: e = A sin(phi + p).
Source: mismatch catalogue, entry encoder_eccentricity; reading of an eccentric graduation, A = lead / (2
    pi) times eccentricity over the radius of the track.
Symbols: e error of the reading, at the table m; A `amplitude_m` m; phi = x `turn_rad_m` screw angle rad; p
    `phase_rad` rad.
Valid: one reading head; two opposite ones cancel it.
Confused with: lead_error_periodic, the same difference between encoder and scale -> only a third sensor
    distinguishes them: with the loop closed on the encoder the table oscillates in both cases.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.ENCODER_READING


class Params(NamedTuple):
    """One harmonic, once a turn."""

    amplitude_m: Annotated[float, Quantity("m", -1e-3, 1e-3, "amplitude A at the table", "um")]
    phase_rad: Annotated[float, Quantity("rad", -7.0, 7.0, "phase p", "deg")]


NEUTRAL = Params(amplitude_m=0.0, phase_rad=0.0)


@kernel
def error_m(p: Any, position_m: float, turn_rad_m: float) -> float:
    """Return the error of the reading (m) at a motor position (m)."""
    return float(p.amplitude_m * math.sin(turn_rad_m * position_m + p.phase_rad))
