"""Locates a change: fits the rigid model before it, and bins the residual after it over all coordinates.

The residual after the change is the change itself, in newtons or metres. Coordinates are ranked as in a
diagnosis (`locate`).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array, Index
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.location.coordinates import Coordinate, coordinates
from reconcile.location.explained_share import bins_in_use, explained_share, samples_in_use
from reconcile.location.locate import in_phase, locate, located_json
from reconcile.nominal_model.model_terms import terms_of_model
from reconcile.recording.recording import AxisRecording
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import regression_problem
from reconcile.regression.residual import Residual, residuals, rms
from reconcile.watch.indicators import INDICATORS

PROFILE_COORDINATES = ("motion_phase", "position", "velocity", "distance_since_reversal")
LEAST_REPORTED_SHARE = 0.05
"""Least reported share of the variance of the residual after the change."""
MAX_LOCATIONS = 4


class BinMeans(NamedTuple):
    """Mean residual by bin; SI, arrays (bins,), NaN where a bin has no sample."""

    mean: Array
    errors: Array
    """Standard error of each mean."""


class ChangeProfile(NamedTuple):
    """The residual of the model before the change, over the bins of a coordinate."""

    coordinate: Coordinate
    by_direction: bool
    """Samples were multiplied by the direction of motion."""
    before: BinMeans
    after: BinMeans


class Comparison(NamedTuple):
    """The comparison in one residual channel of one axis; the model is fitted before the change."""

    rms_before: float
    rms_after: float
    located: list[dict[str, Any]]
    """Entries of `where` in watch.json."""
    profiles: list[ChangeProfile]


def compare(
    before: Sequence[AxisRecording],
    after: Sequence[AxisRecording],
    axis: NominalAxis,
    channel: ResidualChannel,
) -> Comparison:
    """Compare recordings of one axis before and after a change, at least one each."""
    recordings = [*before, *after]
    datasets = [regression_data(recording, axis) for recording in recordings]
    model_terms = [term for term in terms_of_model(axis, datasets) if term.channel is channel]
    shapes = [
        (kind.effect, kind.shape_parameters) for kind in INDICATORS[channel] if kind.effect and kind.beside
    ]
    problem = regression_problem(datasets, channel, shapes, only=True, model_terms=model_terms)
    equations = problem.equations
    chosen = [candidate for candidate in equations.candidates if not candidate.per_recording]
    blocks_before = np.flatnonzero(equations.recording_of_block < len(before))
    theta = equations.solve(equations.slots(chosen), equations.totals(blocks_before))
    sources = [recording.source for recording in recordings]
    analysed = residuals(problem, sources, [(chosen, theta)] * 3, np.zeros(0, dtype=np.int64))
    if channel is ResidualChannel.POSITION_DEVIATION:  # the zero of a scale is arbitrary
        analysed = [one._replace(refitted=one.refitted - one.refitted[one.used].mean()) for one in analysed]
    old, new = analysed[: len(before)], analysed[len(before) :]
    located = [one for one in locate(new, channel, axis) if one.share >= LEAST_REPORTED_SHARE]
    return Comparison(
        rms_before=rms(old, "refitted"),
        rms_after=rms(new, "refitted"),
        located=[located_json(recordings[0].axis, one) for one in located[:MAX_LOCATIONS]],
        profiles=[
            _profile(coordinate, old, new)
            for coordinate in coordinates(analysed, channel)
            if coordinate.name in PROFILE_COORDINATES
        ],
    )


def _profile(coordinate: Coordinate, old: Sequence[Residual], new: Sequence[Residual]) -> ChangeProfile:
    """Return the profile, multiplied by the direction if that shows more of the change."""
    signs = (False, True) if coordinate.has_direction else (False,)
    profiles = [_signed_profile(coordinate, old, new, signed_by_direction=signed) for signed in signs]
    return max(profiles, key=lambda one: float(np.nansum((one.after.mean - one.before.mean) ** 2)))


def _signed_profile(
    coordinate: Coordinate, old: Sequence[Residual], new: Sequence[Residual], *, signed_by_direction: bool
) -> ChangeProfile:
    def bin_means(recorded: Sequence[Residual], bins: Sequence[Index]) -> BinMeans:
        samples = samples_in_use(recorded, [in_phase(residual, residual.refitted) for residual in recorded])
        used_bins = bins_in_use(coordinate._replace(bins=list(bins)), recorded)
        share = explained_share(samples, used_bins, coordinate.size, signed_by_direction=signed_by_direction)
        has_samples = share.counts > 0.0
        return BinMeans(
            np.where(has_samples, share.mean, np.nan), np.where(has_samples, share.errors, np.nan)
        )

    before = bin_means(old, coordinate.bins[: len(old)])
    after = bin_means(new, coordinate.bins[len(old) :])
    return ChangeProfile(coordinate, signed_by_direction, before, after)
