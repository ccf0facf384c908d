"""Unexplained residual: above the noise floor, not negligible, and explained by no term."""

from collections.abc import Sequence

import numpy as np

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.accounted import Accounted
from reconcile.identification.findings import IdentifiedEffect
from reconcile.identification.parameter_estimates import Estimate
from reconcile.regression.residual import Residual, rms
from reconcile.regression.residual_noise import spectral_density
from reconcile.regression.whiteness import LAGS, whiteness

BESIDE_EFFECTS = {
    ResidualChannel.FORCE: ((3.0, 0.25), (20.0, 0.05)),
    ResidualChannel.POSITION_DEVIATION: ((20.0, 0.25),),
}
"""Beside named effects, pairs of the least RMS in noise floors and the least share of the squares of the
refitted residual; either pair suffices. A smaller residual is the misfit of the named effects. Chosen; larger
in the deviation, where the scale's noise is far below the misfit of a wrong shape."""
LEAST_COUNTS = 4.0
"""Least RMS of a deviation in counts: the interpolation of a scale drifts by some counts. Chosen."""
LEAST_COLOUR = 40.0
"""Least Ljung-Box statistic over its degrees of freedom; that of white noise is 1. Chosen."""
FAR_FLOORS = 20.0
"""Least RMS of a force in noise floors that is reported even if white: the test compares samples some filter
times apart, between which a force of short pulses is uncorrelated. Chosen: white residuals of the trials'
quiet axes had at most 12."""
MOST_CONFIDENT = 0.99
"""Upper bound of the confidence in a residual, because the noise floor itself is estimated; chosen."""


def unexplained_residual(
    residuals: Sequence[Residual],
    channel: ResidualChannel,
    sizes: Accounted,
    resolution_m: float | None,
    *,
    alone: bool,
) -> IdentifiedEffect | None:
    """Return a residual above the noise as an `unknown` effect, else None; `alone`: no other finding.

    `resolution_m`: count of the coarser sensor; a deviation below LEAST_COUNTS of it is not reported.
    """
    after, refitted, floor = sizes.residual, rms(residuals, "refitted"), sizes.noise
    is_force = channel is ResidualChannel.FORCE
    if sizes.is_noise or (not is_force and after < LEAST_COUNTS * (resolution_m or 0.0)):
        return None
    if not (alone and is_force) and is_misfit(channel, sizes, refitted):
        return None
    values = [residual.after for residual in residuals]
    is_far = is_force and after >= FAR_FLOORS * floor
    if not is_far and whiteness(residuals, values).q < LEAST_COLOUR * LAGS:
        return None
    frequency_hz, density = spectral_density(residuals, values)
    cumulative = np.cumsum(density) / max(float(density.sum()), 1e-300)
    half_hz = float(frequency_hz[int(np.searchsorted(cumulative, 0.5))])
    factor, unit = (1.0, "N") if is_force else (1e6, "um")
    return IdentifiedEffect(
        effect="unknown",
        channel=channel.value,
        confidence=min(max(1.0 - (sizes.noise / after) ** 2, 0.0), MOST_CONFIDENT),
        equivalent=[],
        rivals=[],
        candidates=[],
        parameters={"rms": Estimate(after, after, after, "N" if is_force else "m")},
        gain=0.0,
        heldout_gain=0.0,
        explanation=(
            f"{after * factor:.3g} {unit} RMS are left, {after / max(floor, 1e-300):.0f} times the noise of "
            f"the sensors, half of it below {half_hz:.2g} Hz: something real that no entry of the catalogue "
            "and no smooth term over a coordinate explains"
        ),
    )


def is_misfit(channel: ResidualChannel, sizes: Accounted, refitted: float) -> bool:
    """Whether the residual beside named effects is their misfit; `refitted`: RMS without any effect."""
    return all(
        sizes.residual < floors * sizes.noise or sizes.residual**2 < share * refitted**2
        for floors, share in BESIDE_EFFECTS[channel]
    )
