"""What was chosen, once more and finely: shapes as numbers, and scenes as the whole model sees them.

The scan looks at the recordings through a rigid model. What it finds tells better where the axis stuck, and
which force a delay delays; and beside all the others each shape is then found more finely.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from reconcile.catalogue.kinds import Sense
from reconcile.catalogue.registry import hypotheses, possible
from reconcile.evidence import Trial
from reconcile.model_force import with_force_of
from reconcile.scenes import difference
from reconcile.smooth_terms import PREFIX
from reconcile.strange_terms import SHARP, term

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape
    from reconcile.ledger import Candidate
    from reconcile.scenes import Difference

    Index = NDArray[np.int64]

STEPS = (1.2, 1.07, 1.02)
"""Ratios of neighbouring shapes, from the scan's inwards."""
REACH = 2
"""So many neighbours to either side are tried in each round."""
SWEEPS = 2
TIE = 1e-3
"""Share of the squares by which shapes that cannot be told apart differ."""
WORTH = 0.05
"""Share of what is left that a further shape of an effect must predict of unseen blocks."""
CONTINUOUS = {
    "stribeck_friction": 1,
    "presliding_hysteresis": 1,
    "amplifier_dead_zone": 1,
    "transport_delay": 1,
    "current_loop_lag": 1,
    "backlash": 2,
    "voltage_saturation": 2,
    **{PREFIX + name: 1 for name in SHARP},
}
"""Effects whose shape begins with so many numbers that can be any."""


def refined(wide: Difference, chosen: list[Candidate], train: Index) -> tuple[Difference, list[Candidate]]:
    """A ledger of the chosen effects alone, each at its best shape beside all the others."""
    best = _fine(wide, chosen, train)
    while True:
        fewer = _without_one(best, train)
        if not fewer:
            return best
        simpler = _fine(wide, fewer, train)
        if _all_possible(best, train) and _left(simpler, train) > (1.0 + WORTH) * _left(best, train):
            return best
        best = simpler


def _fine(wide: Difference, chosen: list[Candidate], train: Index) -> tuple[Difference, list[Candidate]]:
    """First the scan's shapes once more, for scenes and companions are others now; then what lies between."""
    narrow, best = _at(wide, wide.scenes, [(c, [c.shape]) for c in chosen], train)
    for step in (0.0, *STEPS):
        scenes = _seen_through(narrow, best, train)
        narrow, best = _at(wide, scenes, [(c, _options(scenes, wide.sense, c, step)) for c in best], train)
    return narrow, best


def _at(
    wide: Difference, scenes: Sequence[Scene], wanted: list[tuple[Candidate, list[Shape]]], train: Index
) -> tuple[Difference, list[Candidate]]:
    """The best of the shapes that each may have, found in turns."""
    every = [(c.effect, shape) for c, options in wanted for shape in options]
    narrow = difference(scenes, wide.sense, every, only=True, known=wide.known)
    trial = Trial(narrow.ledger, train)
    by_key = narrow.ledger.by_key
    best = [by_key[c.key] for c, _ in wanted]
    for _ in range(SWEEPS):
        for place, (c, shapes) in enumerate(wanted):
            options = [by_key[c.effect, shape, c.per_recording] for shape in shapes]
            others = [*best[:place], *best[place + 1 :]]
            open_options = [option for option in options if option not in others]
            if len(open_options) > 1:
                best[place] = _middle([(o, float(trial.unseen([*others, o]).sum())) for o in open_options])
    return narrow, best


def _middle(left: Sequence[tuple[Candidate, float]]) -> Candidate:
    """Of those that leave the least: where nothing moves, one moment is as good as another."""
    least = min(squares for _, squares in left)
    alike = sorted((o for o, squares in left if squares <= (1.0 + TIE) * least), key=lambda o: o.shape)
    return alike[len(alike) // 2] if len(alike) > 2 else min(left, key=lambda pair: pair[1])[0]


def _options(scenes: Sequence[Scene], sense: Sense, c: Candidate, step: float) -> list[Shape]:
    """Neighbours by a ratio; all shapes of the scan where that is 0."""
    if c.effect not in CONTINUOUS:
        return [c.shape]
    if step:
        numbers = range(CONTINUOUS[c.effect])
        factors = [step**k for k in range(-REACH, REACH + 1)]
        return [*dict.fromkeys([c.shape, *(_times(c.shape, at, k) for at in numbers for k in factors)])]
    scanned = term(c.effect) if c.effect.startswith(PREFIX) else hypotheses(c.effect, sense)[0]
    return [*dict.fromkeys([c.shape, *scanned.shapes(scenes)])]


def _times(shape: Shape, at: int, factor: float) -> Shape:
    return (*shape[:at], factor * shape[at], *shape[at + 1 :])


def _seen_through(narrow: Difference, chosen: list[Candidate], train: Index) -> Sequence[Scene]:
    """The scenes with the force of the whole model, in the force's sense."""
    if narrow.sense is not Sense.FORCE:
        return narrow.scenes
    ledger = narrow.ledger
    slots = ledger.slots(chosen)
    weights = ledger.real(slots, ledger.solve(slots, ledger.totals(train)))
    return [with_force_of(narrow, recording, slots, weights) for recording in range(ledger.recordings)]


def _left(model: tuple[Difference, list[Candidate]], train: Index) -> float:
    narrow, chosen = model
    return float(Trial(narrow.ledger, train).unseen(chosen).sum())


def _all_possible(model: tuple[Difference, list[Candidate]], train: Index) -> bool:
    """Whether nature has each of several shapes of one effect, beside the others."""
    narrow, chosen = model
    trial = Trial(narrow.ledger, train)
    return all(
        possible(c.effect, trial.coefficients([*(o for o in chosen if o != c), c])[-len(c.columns) :])
        for c in chosen
        if sum(o.effect == c.effect for o in chosen) > 1 and not c.per_recording
    )


def _without_one(model: tuple[Difference, list[Candidate]], train: Index) -> list[Candidate]:
    """Without that one of several shapes of one effect that says least; nothing if none has several."""
    narrow, chosen = model
    several = [c for c in chosen if c.effect in CONTINUOUS and sum(o.effect == c.effect for o in chosen) > 1]
    if not several:
        return []
    trial = Trial(narrow.ledger, train)
    fewer = [[one for one in chosen if one != c] for c in several]
    return min(fewer, key=lambda others: float(trial.unseen(others).sum()))
