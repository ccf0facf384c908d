"""Unexplained residual: far above the noise floor, coloured, and explained by no term."""

from collections.abc import Sequence

import numpy as np

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.findings import Estimate, IdentifiedEffect
from reconcile.regression.residual import Residual, rms
from reconcile.regression.residual_noise import LAGS, noise_floor, spectral_density, whiteness

LEAST_FLOOR_RATIO = 20.0
"""Least RMS in noise floors."""
LEAST_COLOUR = 40.0
"""Least Ljung-Box statistic over its degrees of freedom; white noise has 1."""
LEAST_SHARE = 0.25
"""Least share of the refitted model's variance: less is the misfit of an identified effect."""


def unexplained_residual(
    residuals: Sequence[Residual], channel: ResidualChannel, mass_kg: float, resolution_m: float | None
) -> IdentifiedEffect | None:
    """Report a large residual as `unknown`; a deviation below `resolution_m`, one encoder count, is none."""
    after, refitted = rms(residuals, "after"), rms(residuals, "refitted")
    floor = noise_floor(residuals, channel, mass_kg).rms
    visible_m = (resolution_m or 0.0) if channel is ResidualChannel.POSITION_DEVIATION else 0.0
    least = max(LEAST_FLOOR_RATIO * floor, visible_m)
    if after < least or after**2 < LEAST_SHARE * refitted**2:
        return None
    values = [residual.after for residual in residuals]
    if whiteness(residuals, values).q < LEAST_COLOUR * LAGS:
        return None
    frequency_hz, density = spectral_density(residuals, values)
    cumulative = np.cumsum(density) / max(float(density.sum()), 1e-300)
    half_hz = float(frequency_hz[int(np.searchsorted(cumulative, 0.5))])
    factor, unit = (1.0, "N") if channel is ResidualChannel.FORCE else (1e6, "um")
    return IdentifiedEffect(
        effect="unknown",
        channel=channel.value,
        confidence=1.0 - LEAST_SHARE * refitted**2 / after**2,
        equivalent=[],
        rivals=[],
        candidates=[],
        parameters={"rms": Estimate(after, after, after, "N" if channel is ResidualChannel.FORCE else "m")},
        gain=0.0,
        heldout_gain=0.0,
        explanation=(
            f"{after * factor:.3g} {unit} RMS are left, {after / max(floor, 1e-300):.0f} times the noise of "
            f"the sensors, half of it below {half_hz:.2g} Hz: something real that no entry of the catalogue "
            "and no smooth term over a coordinate explains"
        ),
    )
