"""Locates a change: fits the rigid model before it, and bins the residual after it over all coordinates.

The residual after the change is the change itself, in newtons or metres. Coordinates are ranked as in a
diagnosis (`locate`).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
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


class ChangeProfile(NamedTuple):
    """Mean residual of the model before the change, over the bins of a coordinate; SI, arrays (bins,)."""

    coordinate: Coordinate
    by_direction: bool
    """Samples were multiplied by the direction of motion."""
    before: tuple[Array, Array]
    """Mean and standard error."""
    after: tuple[Array, Array]


class Comparison(NamedTuple):
    """The comparison in one residual channel of one axis."""

    rms: tuple[float, float]
    """RMS residual of the model fitted before the change, before and after it."""
    located: list[dict[str, Any]]
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
    model_terms = [one for one in terms_of_model(axis, datasets) if one.channel is channel]
    extra = [
        (kind.effect, kind.shape_parameters) for kind in INDICATORS[channel] if kind.effect and kind.beside
    ]
    found = regression_problem(datasets, channel, extra, only=True, model_terms=model_terms)
    equations = found.equations
    chosen = [candidate for candidate in equations.candidates if not candidate.per_recording]
    blocks = np.flatnonzero(equations.recording_of_block < len(before))
    theta = equations.solve(equations.slots(chosen), equations.totals(blocks))
    sources = [recording.source for recording in recordings]
    analysed = residuals(found, sources, [(chosen, theta)] * 3, np.zeros(0, dtype=np.int64))
    if channel is ResidualChannel.POSITION_DEVIATION:  # the zero of a scale is arbitrary
        analysed = [one._replace(refitted=one.refitted - one.refitted[one.used].mean()) for one in analysed]
    old, new = analysed[: len(before)], analysed[len(before) :]
    located = [one for one in locate(new, channel, axis) if one.share >= LEAST_REPORTED_SHARE][:MAX_LOCATIONS]
    profiles = [
        _profile(of, old, new) for of in coordinates(analysed, channel) if of.name in PROFILE_COORDINATES
    ]
    levels = rms(old, "refitted"), rms(new, "refitted")
    return Comparison(levels, [located_json(recordings[0].axis, one) for one in located], profiles)


def _profile(of: Coordinate, old: Sequence[Residual], new: Sequence[Residual]) -> ChangeProfile:
    """Return the profile, multiplied by the direction if that shows more of the change."""
    signs = (False, True) if of.has_direction else (False,)
    found = [_signed_profile(of, old, new, signed_by_direction=signed) for signed in signs]
    return max(found, key=lambda one: float(np.nansum((one.after[0] - one.before[0]) ** 2)))


def _signed_profile(
    of: Coordinate, old: Sequence[Residual], new: Sequence[Residual], *, signed_by_direction: bool
) -> ChangeProfile:
    sides = []
    for part, bins in ((old, of.bins[: len(old)]), (new, of.bins[len(old) :])):
        given = samples_in_use(part, [in_phase(residual, residual.refitted) for residual in part])
        used = bins_in_use(of._replace(bins=list(bins)), part)
        found = explained_share(given, used, of.size, signed_by_direction=signed_by_direction)
        full = found.counts > 0.0
        sides.append((np.where(full, found.mean, np.nan), np.where(full, found.errors, np.nan)))
    return ChangeProfile(of, signed_by_direction, *sides)
