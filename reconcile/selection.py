"""Which effects a difference asks for: stepwise selection by blocks that were not fitted on.

A hypothesis is taken when it predicts unseen blocks better, by a share that matters and in so many of them
that chance does not explain it. After each step those before it must still be needed, and at the end each
must be better than any other in its place.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from reconcile.belief import BETTER, SHADOWED, Search, believed
from reconcile.catalogue.registry import possible
from reconcile.evidence import SHORTLIST, paired
from reconcile.scenes import SHADOW
from reconcile.smooth_terms import PREFIX

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Sequence

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
LARGEST_SET = 6
TIMING = ("transport_delay", "current_loop_lag")
"""First of all: below one sample they are how the channels were sampled, and no physics."""
TIE = 0.97
"""Of the best gain: less is not as good, however the blocks scatter."""


def select(trial: Trial, rules: Rules) -> list[Candidate]:
    """The hypotheses that are believed, in the order of their taking."""
    search = _search(trial, rules, [])
    timing = _grown(search._replace(named=[c for c in search.named if c.effect in TIMING]), [])
    search = search._replace(start=beside_timing(trial, timing))
    return _exchanged(search, _grown(search, timing))


def select_beside(
    trial: Trial, rules: Rules, begun: Sequence[Candidate], strange: Sequence[Candidate]
) -> list[Candidate]:
    """What of a selection is still believed beside terms without a name, and what is believed only now."""
    search = _search(trial, rules, strange)._replace(start=beside_timing(trial, begun))
    chosen = [*begun, *strange]
    for candidate in (c for c in begun if c.effect in SHADOWED):
        others = [c for c in chosen if c != candidate]
        before = trial.unseen(others)
        if not believed(search, others, trial.score(others, before, candidate), before):
            chosen = others
    sound = [c for c in search.named if c.effect not in SHADOWED]
    return _grown(search._replace(named=sound), chosen)


def beside_timing(trial: Trial, chosen: Sequence[Candidate]) -> float:
    """Sum of squares that there was at the beginning, without what channels out of step had in it."""
    return float(trial.unseen([c for c in chosen if c.effect in TIMING]).sum())


def _search(trial: Trial, rules: Rules, strange: Sequence[Candidate]) -> Search:
    named = [c for c in trial.ledger.candidates if not c.effect.startswith(PREFIX)]
    shadow = [c for c in trial.ledger.candidates if c.effect == SHADOW and c not in strange]
    return Search(trial, rules, named, float(trial.unseen([]).sum()), shadow)


def _grown(search: Search, chosen: list[Candidate]) -> list[Candidate]:
    """One after another, the best first; what a later one makes needless is dropped."""
    tried = {frozenset(chosen)}
    refused: set[Candidate] = set()
    while len(chosen) < search.rules.most_effects:
        before = search.trial.unseen(chosen)
        free = [c for c in _open(search.named, chosen) if c not in refused]
        scores = _scores(search.trial, chosen, before, free)
        scores.sort(key=lambda score: score.gain, reverse=True)
        best = next((score for score in scores if believed(search, chosen, score, before)), None)
        if best is None:
            more = _set_of_one_kind(search, chosen, before, refused)
        else:
            more = [_simplest(search, chosen, best, scores, before)]
        if not more:
            break
        grown = _still_needed(search, [*chosen, *more])
        if frozenset(grown) in tried:  # round in a circle
            refused |= set(more)
            continue
        chosen = grown
        tried.add(frozenset(chosen))
    return chosen


def _simplest(
    search: Search, chosen: list[Candidate], best: Score, scores: list[Score], before: Array
) -> Candidate:
    """Of those that cannot be told from the best, the one with the fewest coefficients."""
    coefficients = search.trial.ledger.coefficients
    as_good = [
        score.candidate
        for score in scores
        if coefficients(score.candidate) < coefficients(best.candidate)
        and score.gain >= TIE * best.gain
        and paired(best.squares, score.squares) < BETTER
        and believed(search, chosen, score, before)
    ]
    return min([best.candidate, *as_good], key=coefficients)


def _set_of_one_kind(
    search: Search, chosen: list[Candidate], before: Array, refused: Container[Candidate]
) -> list[Candidate]:
    """Terms of one effect that nobody believes alone: each harms some blocks until the others are there."""
    trial, rules = search.trial, search.rules
    kinds: dict[tuple[str, bool], list[Candidate]] = {}
    for c in search.named:
        if c.effect in MULTIPLE and c not in chosen and c not in refused:
            kinds.setdefault((c.effect, c.per_recording), []).append(c)
    best: list[Candidate] = []
    most = rules.least_set_gain
    for kind in kinds.values():
        found: list[Candidate] = []
        now, whole = trial.explained(chosen), trial.size
        while len(found) < min(LARGEST_SET, len(kind)):
            rest = [c for c in kind if c not in found]
            c = max(rest, key=lambda c: trial.explained([*chosen, *found, c]))
            explained = trial.explained([*chosen, *found, c])
            if explained - now < rules.least_set_gain * (whole - now):
                break
            found, now = [*found, c], explained
        if len(found) < 2:
            continue
        score = trial.compare([*chosen, *found], before, len(found))
        # so many sets could have been made
        sets = len(search.named) * len(kind) ** (len(found) - 1)
        if score.gain > most and score.beyond_chance(sets, rules.false_alarm):
            best, most = found, score.gain
    return best


def _still_needed(search: Search, chosen: list[Candidate]) -> list[Candidate]:
    """Those without which the rest predicts worse."""
    chosen = _possible(search, chosen)
    for candidate in chosen[:-1]:
        if candidate.effect.startswith(PREFIX):
            continue
        others = [c for c in chosen if c != candidate]
        before = search.trial.unseen(others)
        if candidate.effect in MULTIPLE and any(c.effect == candidate.effect for c in others):
            continue  # one of a set
        if not believed(search, others, search.trial.score(others, before, candidate), before):
            chosen = others
    return chosen


def _possible(search: Search, chosen: list[Candidate]) -> list[Candidate]:
    """Those whose coefficients nature still has, now that others stand beside them."""
    for candidate in chosen:
        others = [c for c in chosen if c != candidate]
        values = search.trial.coefficients([*others, candidate])[-len(candidate.columns) :]
        if not possible(candidate.effect, values):
            chosen = others
    return chosen


def _exchanged(search: Search, chosen: list[Candidate]) -> list[Candidate]:
    """Each against every other effect in its place, beside all the rest."""
    trial = search.trial
    for place in range(len(chosen)):
        if chosen[place].effect.startswith(PREFIX):
            continue
        others = [c for c in chosen if c != chosen[place]]
        before = trial.unseen(others)
        now = trial.score(others, before, chosen[place])
        rivals = [c for c in _open(search.named, others) if c.effect != chosen[place].effect]
        scores = [
            score
            for score in _scores(trial, others, before, rivals)
            if believed(search, others, score, before)
        ]
        better = [s for s in scores if paired(s.squares, now.squares) > BETTER and s.gain > now.gain]
        best = max(better, key=lambda score: score.gain, default=now)
        chosen = [*chosen[:place], _simplest(search, others, best, scores, before), *chosen[place + 1 :]]
    return chosen


def _open(named: Iterable[Candidate], chosen: Sequence[Candidate]) -> list[Candidate]:
    single = {c.effect for c in chosen} - set(MULTIPLE)
    if single & set(TIMING):
        single |= set(TIMING)
    return [c for c in named if c not in chosen and c.effect not in single]


def _scores(
    trial: Trial, chosen: list[Candidate], before: Array, candidates: Sequence[Candidate]
) -> list[Score]:
    """Of those that a plain fit puts in front."""
    explained = {candidate: trial.explained([*chosen, candidate]) for candidate in candidates}
    short = sorted(candidates, key=lambda candidate: explained[candidate], reverse=True)[:SHORTLIST]
    return [trial.score(chosen, before, candidate) for candidate in short]
