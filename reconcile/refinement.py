"""The shapes of what was chosen, found more finely than they were scanned."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
CONTINUOUS = (
    "stribeck_friction",
    "presliding_hysteresis",
    "amplifier_dead_zone",
    "transport_delay",
    "backlash",
)


def refined(
    scenes: Sequence[Scene], sense: Sense, chosen: list[Candidate], train: Index
) -> tuple[Difference, list[Candidate]]:
    """A ledger of the chosen effects alone, each at the best of the shapes about its own."""
    extra: list[tuple[str, Shape]] = [(c.effect, c.shape) for c in chosen]
    for c in chosen:
        if c.effect in CONTINUOUS:
            extra += [(c.effect, (c.shape[0] * factor, *c.shape[1:])) for factor in NEIGHBOURS]
    narrow = difference(scenes, sense, extra, only=True)
    trial = Trial(narrow.ledger, train)
    best: list[Candidate] = []
    for c in chosen:
        allowed = [c.shape, *((c.shape[0] * f, *c.shape[1:]) for f in NEIGHBOURS if c.effect in CONTINUOUS)]
        options = [
            other
            for other in narrow.ledger.candidates
            if (other.effect, other.per_recording) == (c.effect, c.per_recording) and other.shape in allowed
        ]
        best.append(min(options, key=lambda option: float(trial.unseen([*best, option]).sum())))
    return narrow, best
