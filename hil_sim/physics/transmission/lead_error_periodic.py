"""Periodic lead error: the lead deviates with one or a few periods per turn of the screw.

Law: e = A sin(n phi + p).
Source: mismatch catalogue, entry lead_error_periodic, amplitude sin(2 pi x / lead + phase); V_2pi of ISO
    3408-3.
Symbols: e table position minus nominal m; A `amplitude_m` m; n `harmonic` periods per turn; phi = x
    `turn_rad_m` screw angle rad; p `phase_rad` rad.
Valid: amplitude well below lead / (2 pi n), else the table would reverse within a turn.
Confused with: encoder_eccentricity, the same difference between encoder and scale -> a third sensor.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.POSITION_ERROR


class Params(NamedTuple):
    """One harmonic."""

    amplitude_m: Annotated[float, Quantity("m", -1e-4, 1e-4, "amplitude A", "um")]
    harmonic: Annotated[float, Quantity("", 0.0, 100.0, "periods per turn n")]
    phase_rad: Annotated[float, Quantity("rad", -7.0, 7.0, "phase p", "deg")]


NEUTRAL = Params(amplitude_m=0.0, harmonic=1.0, phase_rad=0.0)


@kernel
def error_m(p: Any, position_m: float, turn_rad_m: float) -> float:
    """Return the error of the table position (m)."""
    return float(p.amplitude_m * math.sin(p.harmonic * turn_rad_m * position_m + p.phase_rad))


@kernel
def slope(p: Any, position_m: float, turn_rad_m: float) -> float:
    """Return the derivative of the error by the position."""
    wave = math.cos(p.harmonic * turn_rad_m * position_m + p.phase_rad)
    return float(p.amplitude_m * p.harmonic * turn_rad_m * wave)
