"""Cyclic error of the scale: the interpolation within one grating period is not uniform.

Law: e = A sin(2 pi x / g + p).
Source: mismatch catalogue, entry scale_cyclic_error, e sin(2 pi x / p); Heydemann (1981), offset,
    amplitude and phase errors of the two signals. Offset errors occur once, amplitude errors twice per
    grating period.
Symbols: e error of the reading m; A `amplitude_m` m; x position of the reading head m; g `period_m` grating
    period (or half of it) m; p `phase_rad` at the machine's zero rad.
Valid: well below the bandwidth of the head's electronics.
Confused with: cogging or a lead error of the same pitch, which move the table -> here the table runs
    smoothly; a loop closed on the scale follows the error, with a force that grows with the square of the
    speed.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.SCALE_READING


class Params(NamedTuple):
    """One harmonic of the grating."""

    amplitude_m: Annotated[float, Quantity("m", -1e-4, 1e-4, "amplitude A", "um")]
    period_m: Annotated[float, Quantity("m", 1e-8, 1e-1, "grating period g", "um")]
    phase_rad: Annotated[float, Quantity("rad", -7.0, 7.0, "phase p", "deg")]


NEUTRAL = Params(amplitude_m=0.0, period_m=2e-5, phase_rad=0.0)


@kernel
def error_m(p: Any, position_m: float, _turn_rad_m: float) -> float:
    """Return the error of the reading (m) at a position (m)."""
    return float(p.amplitude_m * math.sin(2.0 * math.pi * position_m / p.period_m + p.phase_rad))
