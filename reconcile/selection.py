"""Which effects a difference asks for: stepwise selection by blocks that were not fitted on.

A hypothesis is taken when it predicts unseen blocks better, by a share that matters and in so many of them
that chance does not explain it. After each step those before it must still be needed, and at the end each
must be better than any other in its place. What no effect explains is offered to the smooth terms.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from reconcile.evidence import SHORTLIST, paired, threshold
from reconcile.smooth_terms import PREFIX

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from reconcile.evidence import Rules, Score, Trial
    from reconcile.ledger import Candidate

    Array = NDArray[np.float64]

MULTIPLE = (
    "cogging",
    "torque_ripple",
    "lead_error_periodic",
    "periodic_disturbance",
    "presliding_hysteresis",
    "scale_cyclic_error",
)
"""Effects that are sums of several shapes; of the others one shape is the best."""
TIMING = ("transport_delay", "current_loop_lag")
"""First of all: below one sample they are how the channels were sampled, and no physics."""
BETTER = 2.0
"""Standard errors by which another effect must be better to take the place of one."""


def select(trial: Trial, rules: Rules) -> list[Candidate]:
    """The hypotheses that are believed, in the order of their taking."""
    named = [c for c in trial.ledger.candidates if not c.effect.startswith(PREFIX)]
    needed = threshold(len(named), len(trial.blocks), rules.false_alarm)
    start = float(trial.unseen([]).sum())
    chosen: list[Candidate] = []
    for candidates in ([c for c in named if c.effect in TIMING], named):
        chosen = _grown(trial, chosen, candidates, rules, needed, start)
    return _exchanged(trial, chosen, named, rules)


def _grown(
    trial: Trial, chosen: list[Candidate], named: list[Candidate], rules: Rules, needed: float, start: float
) -> list[Candidate]:
    """One after another, the best first; what a later one makes needless is dropped."""
    tried = {frozenset(chosen)}
    while len(chosen) < rules.most_effects:
        before = trial.unseen(chosen)
        scores = _scores(trial, chosen, before, _open(named, chosen))
        believed = [score for score in scores if _believed(score, before, rules, needed, start)]
        if not believed:
            break
        chosen = [*chosen, max(believed, key=lambda score: score.gain).candidate]
        chosen = _needed(trial, chosen, rules, needed, start)
        if frozenset(chosen) in tried:
            break
        tried.add(frozenset(chosen))
    return chosen


def _believed(score: Score, before: Array, rules: Rules, needed: float, start: float) -> bool:
    share = float(before.sum() - score.squares.sum()) / max(start, 1e-300)
    return score.t >= needed and score.gain >= rules.least_gain and share >= rules.least_share


def _needed(
    trial: Trial, chosen: list[Candidate], rules: Rules, needed: float, start: float
) -> list[Candidate]:
    """Those without which the rest predicts worse."""
    for candidate in chosen[:-1]:
        others = [c for c in chosen if c != candidate]
        before = trial.unseen(others)
        if not _believed(trial.score(others, before, candidate), before, rules, needed, start):
            chosen = others
    return chosen


def _exchanged(
    trial: Trial, chosen: list[Candidate], named: list[Candidate], rules: Rules
) -> list[Candidate]:
    """Each against every other effect in its place, beside all the rest."""
    for place in range(len(chosen)):
        others = [c for c in chosen if c != chosen[place]]
        before = trial.unseen(others)
        now = trial.score(others, before, chosen[place])
        rivals = [c for c in _open(named, others) if c.effect != chosen[place].effect]
        best = max(_scores(trial, others, before, rivals), key=lambda score: score.gain, default=now)
        if best.gain > now.gain + rules.least_gain and paired(best.squares, now.squares) > BETTER:
            chosen = [*chosen[:place], best.candidate, *chosen[place + 1 :]]
    return chosen


def _open(named: Iterable[Candidate], chosen: Sequence[Candidate]) -> list[Candidate]:
    single = {c.effect for c in chosen} - set(MULTIPLE)
    return [c for c in named if c not in chosen and c.effect not in single]


def _scores(
    trial: Trial, chosen: list[Candidate], before: Array, candidates: Sequence[Candidate]
) -> list[Score]:
    """Of those that a plain fit puts in front."""
    explained = {candidate: trial.explained([*chosen, candidate]) for candidate in candidates}
    short = sorted(candidates, key=lambda candidate: explained[candidate], reverse=True)[:SHORTLIST]
    return [trial.score(chosen, before, candidate) for candidate in short]


def unexplained(trial: Trial, chosen: list[Candidate], rules: Rules) -> list[Candidate]:
    """The smooth terms that what is left still asks for, at most two."""
    smooth = [c for c in trial.ledger.candidates if c.effect.startswith(PREFIX)]
    needed = threshold(len(smooth), len(trial.blocks), rules.false_alarm)
    start = float(trial.unseen([]).sum())
    found: list[Candidate] = []
    while len(found) < rules.most_unknown:
        before = trial.unseen([*chosen, *found])
        scores = [trial.score([*chosen, *found], before, c) for c in smooth if c not in found]
        believed = [
            score
            for score in scores
            if score.t >= needed
            and score.gain >= rules.least_unknown
            and float(before.sum() - score.squares.sum()) >= rules.least_unknown * start
        ]
        if not believed:
            break
        found.append(max(believed, key=lambda score: score.gain).candidate)
    return found
