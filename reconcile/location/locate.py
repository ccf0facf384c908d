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
from reconcile.location.explained_share import Samples, Share, samples, share, used_bins
from reconcile.location.pitches import order_bands, order_name, over_time, over_turns, time_bands
from reconcile.location.spectral_lines import Line, lines, motion_frequencies_hz
from reconcile.regression.regression_data import FILTER_HZ
from reconcile.regression.residual import Residual
from reconcile.regression.state_filter import ORDER

EXCESS_SHARE = 0.8
"""Share of the excess square mean that the reported range of bins holds."""


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
    """The peak's bin, or the name of an order: `1 a pole pair`."""


def locate(
    residuals: Sequence[Residual], channel: ResidualChannel, axis: NominalAxis
) -> list[LocatedResidual]:
    """All coordinates and lines of these recordings, the one that explains most first."""
    values = [in_phase(residual, residual.refitted) for residual in residuals]
    in_use, found = _levels(samples(residuals, values), channel)
    found += [_best(in_use, of, used_bins(of, residuals), channel) for of in coordinates(residuals, channel)]
    orders = _orders(residuals, values, axis)
    found += [_line("order", "1/turn", channel, line, order_name(line, axis)) for line in orders]
    found += [_line("frequency", "Hz", channel, line) for line in _frequencies(residuals, values)]
    return sorted(found, key=lambda one: -one.share)


def in_phase(residual: Residual, values: Array) -> Array:
    """Undo the phase of the state filter at every frequency; its attenuation stays."""
    period_s = residual.data.period_s
    n = len(values)
    size = next_fast_len(n + 2 * math.ceil(12.0 / (2.0 * math.pi * FILTER_HZ) / period_s))
    warped = np.tan(np.minimum(math.pi * np.arange(size // 2 + 1) / size, 0.499 * math.pi))
    lag_rad = ORDER * np.arctan(2.0 * warped / (period_s * 2.0 * math.pi * FILTER_HZ))
    shifted: Array = irfft(rfft(values, size) * np.exp(1j * lag_rad), size)[:n]
    return shifted


def _orders(residuals: Sequence[Residual], values: Sequence[Array], axis: NominalAxis) -> list[Line]:
    tracks = [over_turns(residual, of) for residual, of in zip(residuals, values, strict=True)]
    bands = order_bands(axis)
    return lines(tracks, bands, [np.empty(0)] * len(bands))


def _frequencies(residuals: Sequence[Residual], values: Sequence[Array]) -> list[Line]:
    tracks = [over_time(residual, of) for residual, of in zip(residuals, values, strict=True)]
    datasets, bands = [residual.data for residual in residuals], time_bands(residuals)
    motion_hz = np.concatenate(
        [motion_frequencies_hz(data.motion.velocity_m_s, data.period_s) for data in datasets]
    )
    skip = [motion_hz[(motion_hz > 0.9 * low) & (motion_hz < 1.1 * high)] for low, high in bands]
    return lines(tracks, bands, skip)


def _best(in_use: Samples, coordinate: Coordinate, bins: Index, channel: ResidualChannel) -> LocatedResidual:
    signs = (False, True) if coordinate.has_direction else (False,)
    shares = [share(in_use, bins, coordinate.size, signed_by_direction=signed) for signed in signs]
    found = max(shares, key=lambda one: one.share)
    centres, (first, last), peak = coordinate.centres, _range(found), _peak(found)
    return LocatedResidual(
        coordinate=coordinate.name,
        unit=coordinate.unit,
        channel=channel,
        low=float(coordinate.edges[first]),
        high=float(coordinate.edges[last + 1]),
        share=found.share,
        by_direction=found.by_direction,
        peak=float(found.mean[peak]),
        peak_at=float(centres[peak]),
        centres=centres,
        profile=found.mean,
        errors=found.errors,
        labels=coordinate.labels,
        label=coordinate.labels[peak] if coordinate.labels else "",
    )


def _peak(found: Share) -> int:
    """The bin whose mean exceeds two standard errors by most."""
    sure = np.abs(found.mean) - 2.0 * found.errors
    return int(np.argmax(np.where(found.counts > 0.0, sure, -np.inf)))


def _range(found: Share) -> tuple[int, int]:
    """First and last of the fewest neighbouring bins with EXCESS_SHARE, grown from the fullest one."""
    excess = found.counts * np.maximum(found.mean**2 - found.errors**2, 0.0)
    whole = float(excess.sum())
    first = last = int(np.argmax(excess))
    while whole > 0.0 and excess[first : last + 1].sum() < EXCESS_SHARE * whole:
        before = excess[first - 1] if first > 0 else -1.0
        after = excess[last + 1] if last + 1 < len(excess) else -1.0
        first, last = (first - 1, last) if before > after else (first, last + 1)
    return (first, last) if whole > 0.0 else (0, len(excess) - 1)


def _levels(in_use: Samples, channel: ResidualChannel) -> tuple[Samples, list[LocatedResidual]]:
    """Take the mean and the mean times direction off the samples, the larger one first.

    They are removed so that no other coordinate is credited with them.
    """
    everywhere, found = np.zeros(len(in_use.values), dtype=np.int64), []
    remaining = {False: "constant", True: "direction"}
    while remaining:
        levels = [share(in_use, everywhere, 1, signed_by_direction=signed) for signed in remaining]
        level = max(levels, key=lambda one: one.share)
        name, peak = remaining.pop(level.by_direction), float(level.mean[0])
        found.append(
            LocatedResidual(
                coordinate=name,
                unit="",
                channel=channel,
                low=0.0,
                high=0.0,
                share=level.share,
                by_direction=level.by_direction,
                peak=peak,
                peak_at=0.0,
            )
        )
        if level.share > 0.0:
            direction = in_use.direction if level.by_direction else 1.0
            in_use = in_use._replace(values=in_use.values - level.mean[0] * direction)
    return in_use, found


def _line(name: str, unit: str, channel: ResidualChannel, line: Line, label: str = "") -> LocatedResidual:
    low, high = max(line.cycles - line.width, 0.0), line.cycles + line.width
    return LocatedResidual(
        coordinate=name,
        unit=unit,
        channel=channel,
        low=low,
        high=high,
        share=line.share,
        by_direction=False,
        peak=line.amplitude,
        peak_at=line.cycles,
        label=label,
    )


def located_json(name: str, one: LocatedResidual) -> dict[str, Any]:
    """An entry of `located` in verdict.json; the range of a line is its width."""
    return {
        "axis": name,
        "sensor": one.channel.value,
        "coordinate": one.coordinate,
        "unit": one.unit,
        "range": [one.low, one.high],
        "share": one.share,
        "by_direction": one.by_direction,
        "peak": one.peak,
        "peak_unit": "N" if one.channel is ResidualChannel.FORCE else "m",
        "at": one.peak_at,
        "label": one.label,
    }
