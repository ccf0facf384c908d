"""What no effect explains is offered to terms without a name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from reconcile.evidence import Trial
from reconcile.scenes import difference
from reconcile.selection import beside_timing
from reconcile.smooth_terms import PREFIX
from reconcile.strange_terms import every_shape

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Shape
    from reconcile.evidence import Rules
    from reconcile.ledger import Candidate
    from reconcile.scenes import Difference

    Index = NDArray[np.int64]


def unexplained(
    final: Difference, chosen: Sequence[Candidate], train: Index, rules: Rules
) -> list[tuple[str, Shape]]:
    """The terms, at most two, that what is left beside the `chosen` effects still asks for."""
    tried = [*((c.effect, c.shape) for c in chosen), *every_shape(final.scenes, final.sense)]
    wide = difference(final.scenes, final.sense, tried, only=True, known=final.known)
    trial = Trial(wide.ledger, train)
    wide.ledger.rows.clear()
    strange = [c for c in wide.ledger.candidates if c.effect.startswith(PREFIX)]
    named = [wide.ledger.by_key[c.key] for c in chosen]
    start = beside_timing(trial, named)
    found: list[Candidate] = []
    while len(found) < rules.most_unknown:
        before = trial.unseen([*named, *found])
        free = [c for c in strange if c.effect not in {other.effect for other in found}]
        scores = [trial.score([*named, *found], before, c) for c in free]
        believed = [
            score
            for score in scores
            if score.beyond_chance(len(strange), rules.false_alarm)
            and score.gain >= rules.least_unknown
            and float(before.sum() - score.squares.sum()) >= rules.least_unknown_share * start
        ]
        if not believed:
            break
        found.append(max(believed, key=lambda score: score.gain).candidate)
    return [(c.effect, c.shape) for c in found]
