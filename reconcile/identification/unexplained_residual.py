"""Unexplained residual: above the noise floor, not negligible, and explained by no term."""

import math
from collections.abc import Sequence

import numpy as np

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.accounted import Accounted
from reconcile.identification.findings import IdentifiedEffect
from reconcile.identification.parameter_estimates import Estimate
from reconcile.regression.residual import Residual
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
LEAST_STRENGTH = {ResidualChannel.FORCE: 25.0, ResidualChannel.POSITION_DEVIATION: 120.0}
"""Least RMS in noise floors times the root of the Ljung-Box statistic over its degrees of freedom, which is 1
for white noise. Slow noise, which the floor leaves out, has several floors and little correlation; a small
force has few floors and much correlation. Chosen: linear axes of the blind trials with nothing concealed have
at most 20 in the force if its RMS is 3 floors or more; 20 floors and a statistic of 36 in the deviation."""
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
    after, floor = sizes.residual, sizes.noise
    is_force = channel is ResidualChannel.FORCE
    if sizes.is_noise or (not is_force and after < LEAST_COUNTS * (resolution_m or 0.0)):
        return None
    if not (alone and is_force) and is_misfit(channel, sizes, varying_rms(residuals)):
        return None
    values = [residual.after for residual in residuals]
    if after * math.sqrt(whiteness(residuals, values).q / LAGS) < LEAST_STRENGTH[channel] * floor:
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


def varying_rms(residuals: Sequence[Residual]) -> float:
    """RMS of the residual without any effect about its mean: a constant force has no misfit."""
    values = np.concatenate([residual.refitted[residual.used] for residual in residuals])
    return float(np.std(values))


def is_misfit(channel: ResidualChannel, sizes: Accounted, refitted: float) -> bool:
    """Whether the residual beside named effects is their misfit; `refitted`: `varying_rms`."""
    return all(
        sizes.residual < floors * sizes.noise or sizes.residual**2 < share * refitted**2
        for floors, share in BESIDE_EFFECTS[channel]
    )
