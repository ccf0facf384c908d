"""Before and after: where a machine differs from itself, over which coordinate, phase and range.

The rigid model is fitted on recordings before the change, and read on those after it: what is left is the
change, in newtons or metres. Places are ranked as in a diagnosis (`locate`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import Sense
from reconcile.locate import as_json, in_phase, locate
from reconcile.locate_coordinates import coordinates
from reconcile.locate_share import joined, samples, share
from reconcile.model_effects import model_effects
from reconcile.rests import rests, rms
from reconcile.scenes import difference, scene_of
from reconcile.watch_kinds import KINDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.locate_coordinates import Coordinate
    from reconcile.model_file import NominalAxis
    from reconcile.recording import AxisRecording
    from reconcile.rests import Rest

    Array = NDArray[np.float64]

SHOWN = ("motion_phase", "position", "velocity", "distance_since_reversal")
WORTH_TELLING = 0.05
"""Share of the change's variance that a place must explain."""
MOST_PLACES = 4


class Profile(NamedTuple):
    """Mean of what the model before leaves, by bin of a coordinate; SI."""

    coordinate: str
    unit: str
    centres: Array
    labels: tuple[str, ...]
    logarithmic: bool
    by_direction: bool
    """Turned round with the direction of motion."""
    before: tuple[Array, Array]
    """Mean and standard error."""
    after: tuple[Array, Array]


class Compared(NamedTuple):
    """One sense of one axis."""

    sense: Sense
    rms: tuple[float, float]
    """Of what the model before leaves, before and after."""
    located: list[dict[str, Any]]
    profiles: list[Profile]


def compare(
    before: Sequence[AxisRecording], after: Sequence[AxisRecording], axis: NominalAxis, sense: Sense
) -> Compared:
    """Of recordings of one axis, of any motion; both at least one."""
    every = [*before, *after]
    scenes = [scene_of(recording, axis) for recording in every]
    known = [one for one in model_effects(axis.held, axis, scenes) if one.sense is sense]
    extra = [(kind.effect, kind.shape) for kind in KINDS[sense] if kind.effect and kind.beside]
    found = difference(scenes, sense, extra, only=True, known=known)
    ledger = found.ledger
    chosen = [candidate for candidate in ledger.candidates if not candidate.per_recording]
    blocks = np.flatnonzero(ledger.recording_of_block < len(before))
    theta = ledger.solve(ledger.slots(chosen), ledger.totals(blocks))
    sources = [recording.source for recording in every]
    left = rests(found, sources, [(chosen, theta)] * 3, np.zeros(0, dtype=np.int64))
    if sense is Sense.DEVIATION:  # where a scale was zeroed is nobody's change
        left = [one._replace(refitted=one.refitted - one.refitted[one.used].mean()) for one in left]
    old, new = left[: len(before)], left[len(before) :]
    located = [one for one in locate(new, sense, axis) if one.share >= WORTH_TELLING][:MOST_PLACES]
    profiles = [_profile(of, old, new) for of in coordinates(left, sense) if of.name in SHOWN]
    levels = rms(old, "refitted"), rms(new, "refitted")
    return Compared(sense, levels, [as_json(every[0].axis, one) for one in located], profiles)


def _profile(of: Coordinate, old: Sequence[Rest], new: Sequence[Rest]) -> Profile:
    """Turned round with the direction where the change shows more so."""
    found = [_one_way(of, old, new, turned=turned) for turned in (False, True)[: 1 + of.both_ways]]
    return max(found, key=lambda one: float(np.nansum((one.after[0] - one.before[0]) ** 2)))


def _one_way(of: Coordinate, old: Sequence[Rest], new: Sequence[Rest], *, turned: bool) -> Profile:
    sides = []
    for part, bins in ((old, of.bins[: len(old)]), (new, of.bins[len(old) :])):
        given = samples(part, [in_phase(rest, rest.refitted) for rest in part])
        found = share(given, joined(of._replace(bins=list(bins)), part), of.size, turned=turned)
        full = found.counts > 0.0
        sides.append((np.where(full, found.mean, np.nan), np.where(full, found.errors, np.nan)))
    return Profile(of.name, of.unit, of.centres, of.labels, of.logarithmic, turned, sides[0], sides[1])
