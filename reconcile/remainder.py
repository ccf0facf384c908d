"""What is left when all is said: far above the noise, of one colour, and explained by nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Sense
from reconcile.findings import Estimate, Finding
from reconcile.locate_noise import LAGS, noise_floor, spectral_density, whiteness
from reconcile.rests import rms

if TYPE_CHECKING:
    from collections.abc import Sequence

    from reconcile.rests import Rest

ABOVE = 20.0
"""Noise floors."""
COLOURED = 40.0
"""Ljung-Box statistic in its degrees of freedom; 1 is white."""
MOST = 0.25
"""Share of the variance at the beginning: less is a crumb of what was found."""


def remainder(
    rests: Sequence[Rest], sense: Sense, mass_kg: float, resolution_m: float | None
) -> Finding | None:
    """`unknown`, where it is large; `resolution_m`: no deviation below one count of the encoder is one."""
    after, refitted = rms(rests, "after"), rms(rests, "refitted")
    floor = noise_floor(rests, sense, mass_kg).rms
    least = max(ABOVE * floor, (resolution_m or 0.0) if sense is Sense.DEVIATION else 0.0)
    if after < least or after**2 < MOST * refitted**2:
        return None
    left = [rest.after for rest in rests]
    if whiteness(rests, left).q < COLOURED * LAGS:
        return None
    frequency_hz, density = spectral_density(rests, left)
    below = np.cumsum(density) / max(float(density.sum()), 1e-300)
    half_hz = float(frequency_hz[int(np.searchsorted(below, 0.5))])
    factor, unit = (1.0, "N") if sense is Sense.FORCE else (1e6, "um")
    return Finding(
        "unknown",
        sense.value,
        1.0 - MOST * refitted**2 / after**2,
        [],
        [],
        [],
        {"rms": Estimate(after, after, after, "N" if sense is Sense.FORCE else "m")},
        0.0,
        0.0,
        f"{after * factor:.3g} {unit} RMS are left, {after / max(floor, 1e-300):.0f} times the noise of the "
        f"sensors, half of it below {half_hz:.2g} Hz: something real that no entry of the catalogue and no "
        "smooth term over a coordinate explains",
    )
