"""The shapes of what was chosen, found more finely than they were scanned."""

from __future__ import annotations

from typing import TYPE_CHECKING

from reconcile.catalogue.registry import ENTRIES
from reconcile.evidence import Trial
from reconcile.scenes import difference

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Sense, Shape
    from reconcile.ledger import Candidate
    from reconcile.scenes import Difference

    Index = NDArray[np.int64]

NEIGHBOURS = (0.7, 0.8, 0.9, 1.1, 1.25, 1.4)
"""Shapes about the best one of the scan, to be tried after it."""
SWEEPS = 2
CONTINUOUS = (
    "stribeck_friction",
    "presliding_hysteresis",
    "amplifier_dead_zone",
    "transport_delay",
    "current_loop_lag",
    "backlash",
)


def refined(wide: Difference, chosen: list[Candidate], train: Index) -> tuple[Difference, list[Candidate]]:
    """A ledger of the chosen effects alone, each at its best shape beside all the others."""
    _, best = _at(wide, [(c, _scanned(wide.scenes, wide.sense, c)) for c in chosen], train)
    return _at(wide, [(c, _about(c)) for c in best], train)


def _at(
    wide: Difference, wanted: list[tuple[Candidate, list[Shape]]], train: Index
) -> tuple[Difference, list[Candidate]]:
    """The best of the shapes that each may have, found in turns."""
    every = [(c.effect, shape) for c, options in wanted for shape in options]
    narrow = difference(wide.scenes, wide.sense, every, only=True, known=wide.known)
    trial = Trial(narrow.ledger, train)
    by_key = {(c.effect, c.shape, c.per_recording): c for c in narrow.ledger.candidates}
    best = [by_key[c.effect, c.shape, c.per_recording] for c, _ in wanted]
    for _ in range(SWEEPS):
        for place, (c, shapes) in enumerate(wanted):
            options = [by_key[c.effect, shape, c.per_recording] for shape in shapes]
            others = [*best[:place], *best[place + 1 :]]
            open_options = [option for option in options if option not in others]
            best[place] = min(open_options, key=lambda o: float(trial.unseen([*others, o]).sum()))
    return narrow, best


def _scanned(scenes: Sequence[Scene], sense: Sense, c: Candidate) -> list[Shape]:
    """All shapes of the scan, for an effect whose shape is a number that can have any value."""
    if c.effect not in CONTINUOUS:
        return [c.shape]
    hypothesis = next(h for h in ENTRIES[c.effect].HYPOTHESES if h.sense is sense)
    return [*dict.fromkeys([c.shape, *hypothesis.shapes(scenes)])]


def _about(c: Candidate) -> list[Shape]:
    if c.effect not in CONTINUOUS:
        return [c.shape]
    return [c.shape, *((c.shape[0] * factor, *c.shape[1:]) for factor in NEIGHBOURS)]
