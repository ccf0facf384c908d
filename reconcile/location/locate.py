"""Rank coordinates and spectral lines by the cross-validated share of the residual that they explain.

The residual is that of the refitted nominal model: it holds what no parameter value explains. It is shifted
into phase with the motion first, because the state filter delays it.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from kernels.arrays import Array, Index
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.location.coordinates import Coordinate, coordinates
from reconcile.location.explained_share import (
    ExplainedShare,
    SamplesInUse,
    bins_in_use,
    explained_share,
    samples_in_use,
)
from reconcile.location.search_bands import order_bands, order_name, over_time, over_turns, time_bands
from reconcile.location.spectra import motion_frequencies_hz
from reconcile.location.spectral_lines import SpectralLine, find_lines
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.residual import Residual
from reconcile.regression.state_filter import ORDER

EXCESS_SHARE = 0.8
"""Share of the squared mean beyond its error that the reported range of bins holds; chosen."""


class LocatedResidual(NamedTuple):
    """A coordinate or spectral line and what it explains; SI, the residual in N or m by its channel."""

    coordinate: str
    unit: str
    channel: ResidualChannel
    low: float
    high: float
    """Range of the coordinate that holds most of the excess."""
    share: float
    """Of the variance, cross-validated, beyond the constant and the direction."""
    by_direction: bool
    """The residual changes its sign with the direction of motion; profile and peak are those forwards."""
    peak: float
    """Largest significant mean, or the amplitude of a line."""
    peak_at: float
    centres: Array = np.empty(0)
    profile: Array = np.empty(0)
    """Mean residual by bin; empty for a line."""
    errors: Array = np.empty(0)
    """Standard error of each mean."""
    labels: tuple[str, ...] = ()
    """Names of the bins, if any."""
    label: str = ""
    """Name of the peak's bin, or of an order: `1 a pole pair`."""


def locate(
    residuals: Sequence[Residual], channel: ResidualChannel, axis: NominalAxis
) -> list[LocatedResidual]:
    """All coordinates and lines of these recordings, the one that explains most first."""
    values = [in_phase(residual, residual.refitted) for residual in residuals]
    samples, located = _without_levels(samples_in_use(residuals, values), channel)
    located += [
        _over_coordinate(samples, coordinate, bins_in_use(coordinate, residuals), channel)
        for coordinate in coordinates(residuals, channel)
    ]
    orders = _orders(residuals, values, axis)
    located += [_over_line("order", "1/turn", channel, line, order_name(line, axis)) for line in orders]
    located += [_over_line("frequency", "Hz", channel, line) for line in _frequencies(residuals, values)]
    return sorted(located, key=lambda one: -one.share)


def in_phase(residual: Residual, values: Array) -> Array:
    """The values (n,) without the phase of the state filter at any frequency; its attenuation stays."""
    period_s = residual.data.period_s
    n = len(values)
    size = next_fast_len(n + 2 * math.ceil(12.0 / (2.0 * math.pi * FILTER_HZ) / period_s))
    warped = np.tan(np.minimum(math.pi * np.arange(size // 2 + 1) / size, 0.499 * math.pi))
    lag_rad = ORDER * np.arctan(2.0 * warped / (period_s * 2.0 * math.pi * FILTER_HZ))
    shifted: Array = irfft(rfft(values, size) * np.exp(1j * lag_rad), size)[:n]
    return shifted


def _orders(residuals: Sequence[Residual], values: Sequence[Array], axis: NominalAxis) -> list[SpectralLine]:
    tracks = [over_turns(residual, of) for residual, of in zip(residuals, values, strict=True)]
    bands = order_bands(axis)
    return find_lines(tracks, bands, [np.empty(0)] * len(bands))


def _frequencies(residuals: Sequence[Residual], values: Sequence[Array]) -> list[SpectralLine]:
    tracks = [over_time(residual, of) for residual, of in zip(residuals, values, strict=True)]
    datasets, bands = [residual.data for residual in residuals], time_bands(residuals)
    motion_hz = np.concatenate(
        [motion_frequencies_hz(data.motion.velocity_m_s, data.period_s) for data in datasets]
    )
    excluded = [motion_hz[(motion_hz > 0.9 * band.low) & (motion_hz < 1.1 * band.high)] for band in bands]
    return find_lines(tracks, bands, excluded)


def _over_coordinate(
    samples: SamplesInUse, coordinate: Coordinate, bins: Index, channel: ResidualChannel
) -> LocatedResidual:
    """What a coordinate explains of the residual, or of the residual times direction if that is more."""
    signs = (False, True) if coordinate.has_direction else (False,)
    shares = [explained_share(samples, bins, coordinate.size, signed_by_direction=signed) for signed in signs]
    best = max(shares, key=lambda one: one.share)
    centres, excess, peak = coordinate.centres, _excess_range(best), _peak_bin(best)
    return LocatedResidual(
        coordinate=coordinate.name,
        unit=coordinate.unit,
        channel=channel,
        low=float(coordinate.edges[excess.first]),
        high=float(coordinate.edges[excess.last + 1]),
        share=best.share,
        by_direction=best.by_direction,
        peak=float(best.mean[peak]),
        peak_at=float(centres[peak]),
        centres=centres,
        profile=best.mean,
        errors=best.errors,
        labels=coordinate.labels,
        label=coordinate.labels[peak] if coordinate.labels else "",
    )


def _peak_bin(share: ExplainedShare) -> int:
    """The bin whose mean exceeds two standard errors by most."""
    certain = np.abs(share.mean) - 2.0 * share.errors
    return int(np.argmax(np.where(share.counts > 0.0, certain, -np.inf)))


class _BinRange(NamedTuple):
    first: int
    last: int
    """Included."""


def _excess_range(share: ExplainedShare) -> _BinRange:
    """The fewest neighbouring bins that hold EXCESS_SHARE, grown from the one with the largest excess."""
    excess = share.counts * np.maximum(share.mean**2 - share.errors**2, 0.0)
    total = float(excess.sum())
    if total <= 0.0:
        return _BinRange(0, len(excess) - 1)
    first = last = int(np.argmax(excess))
    while excess[first : last + 1].sum() < EXCESS_SHARE * total:
        below = excess[first - 1] if first > 0 else -1.0
        above = excess[last + 1] if last + 1 < len(excess) else -1.0
        first, last = (first - 1, last) if below > above else (first, last + 1)
    return _BinRange(first, last)


class _WithoutLevels(NamedTuple):
    samples: SamplesInUse
    levels: list[LocatedResidual]
    """The mean everywhere, and the mean times direction."""


def _without_levels(samples: SamplesInUse, channel: ResidualChannel) -> _WithoutLevels:
    """Subtract the mean and the mean times direction from the samples, the larger one first.

    Without them no other coordinate is credited with what they explain.
    """
    one_bin, levels = np.zeros(len(samples.values), dtype=np.int64), []
    remaining = {False: "constant", True: "direction"}
    while remaining:
        shares = [explained_share(samples, one_bin, 1, signed_by_direction=signed) for signed in remaining]
        level = max(shares, key=lambda one: one.share)
        levels.append(
            LocatedResidual(
                coordinate=remaining.pop(level.by_direction),
                unit="",
                channel=channel,
                low=0.0,
                high=0.0,
                share=level.share,
                by_direction=level.by_direction,
                peak=float(level.mean[0]),
                peak_at=0.0,
            )
        )
        if level.share > 0.0:
            direction = samples.direction if level.by_direction else 1.0
            samples = samples._replace(values=samples.values - level.mean[0] * direction)
    return _WithoutLevels(samples, levels)


def _over_line(
    coordinate: str, unit: str, channel: ResidualChannel, line: SpectralLine, label: str = ""
) -> LocatedResidual:
    return LocatedResidual(
        coordinate=coordinate,
        unit=unit,
        channel=channel,
        low=max(line.cycles - line.width, 0.0),
        high=line.cycles + line.width,
        share=line.share,
        by_direction=False,
        peak=line.amplitude,
        peak_at=line.cycles,
        label=label,
    )


def located_json(axis: str, located: LocatedResidual) -> dict[str, Any]:
    """An entry of `located` in verdict.json; the range of a line is its width."""
    return {
        "axis": axis,
        "sensor": located.channel.value,
        "coordinate": located.coordinate,
        "unit": located.unit,
        "range": [located.low, located.high],
        "share": located.share,
        "by_direction": located.by_direction,
        "peak": located.peak,
        "peak_unit": "N" if located.channel is ResidualChannel.FORCE else "m",
        "at": located.peak_at,
        "label": located.label,
    }
