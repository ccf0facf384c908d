"""From what was chosen to what is said: shapes refined, parameters with intervals, rivals, held-out gain."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.stats import norm

from reconcile.catalogue.registry import meaning_of, systematic
from reconcile.catalogue.temperature_dependent_friction import DRIFT, own_levels
from reconcile.confidence import confidence
from reconcile.evidence import SHORTLIST, paired
from reconcile.ledger import names
from reconcile.resolution import reversal_way_m
from reconcile.selection import TIMING
from reconcile.smooth_terms import PREFIX

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Shape
    from reconcile.evidence import Score, Trial
    from reconcile.ledger import Candidate
    from reconcile.scenes import Difference

    Array = NDArray[np.float64]
    Index = NDArray[np.int64]

RESAMPLES = 400
ANGLE = "_rad"
LEAST_NAMED = 0.1
"""Share of what is left without it, on held-out blocks, from which on an effect is spoken of."""
HELD = 0.5
"""Of a sample: so late a force that is held for one is in the mean. A delay may hold that, or not."""
DOUBTFUL = 0.4
"""Confidence below which another name would be better."""
UNDECIDED = 2.0
"""A rival whose unseen blocks are worse by less than so many standard errors cannot be told apart."""


class Estimate(NamedTuple):
    """A parameter in SI with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str


class Rival(NamedTuple):
    """Another effect that was considered in the place of one."""

    effect: str
    confidence: float
    """Probability that it would predict unseen blocks better."""
    share: float
    """Of the gain of the effect that was taken."""


class Finding(NamedTuple):
    """An effect that was left out."""

    effect: str
    sense: str
    confidence: float
    equivalent: list[str]
    rivals: list[Rival]
    candidates: list[Candidate]
    parameters: dict[str, Estimate]
    gain: float
    """Share of the variance unexplained before it, on unseen blocks."""
    heldout_gain: float
    explanation: str
    share: float = 0.0
    """Of the held-out variance, with no effect but this one: they are ranked by it."""


class Estimates(NamedTuple):
    """All parameters of a model, with intervals by resampling whole blocks."""

    base: dict[str, Estimate]
    of: dict[Candidate, dict[str, Estimate]]


def estimates(final: Difference, chosen: Sequence[Candidate], blocks: Index) -> Estimates:
    """Fitted on `blocks`. What each recording has for itself is that of the first one."""
    ledger = final.ledger
    slots = ledger.slots(chosen)
    rng = np.random.default_rng(0)
    middle = ledger.real(slots, ledger.solve(slots, ledger.totals(blocks)))
    drawn = [
        ledger.real(slots, ledger.solve(slots, ledger.totals(rng.choice(blocks, len(blocks)))))
        for _ in range(RESAMPLES)
    ]
    base = {}
    for place, (column, own) in enumerate(slots):
        name = final.base_names[column] if column < len(ledger.base) and own < 1 else ""
        if name:
            value = float(middle[place])
            low, high = _interval(value, [float(one[place]) for one in drawn], name)
            base[name] = Estimate(value, low, high, "")
    found: dict[Candidate, dict[str, Estimate]] = {}
    first = len(ledger.slots([]))
    for candidate in chosen:
        count = len(candidate.columns)
        part = slice(first, first + count)
        first += ledger.coefficients(candidate)
        meaning = meaning_of(candidate.effect).parameters
        values = meaning(candidate.shape, middle[part])
        spread = [meaning(candidate.shape, one[part]) for one in drawn]
        found[candidate] = {}
        for key, parameter in values.items():
            low, high = _interval(parameter.value, [other[key].value for other in spread], key)
            if low < high and not key.endswith(ANGLE):
                under, over = systematic(candidate.effect, key, final.sense)
                held_s = HELD * final.scenes[0].period_s if candidate.effect in TIMING else 0.0
                low -= under * abs(parameter.value) + held_s
                high += over * abs(parameter.value)
            found[candidate][key] = Estimate(parameter.value, low, high, parameter.unit)
    return Estimates(base, found)


def _interval(value: float, drawn: Sequence[float], key: str) -> tuple[float, float]:
    """The middle 95 %; angles are taken about their value."""
    spread = np.array(drawn) - value
    if key.endswith(ANGLE):
        spread = (spread + math.pi) % (2.0 * math.pi) - math.pi
    low, high = np.percentile(spread, [2.5, 97.5])
    return value + float(low), value + float(high)


def contest(trial: Trial, chosen: Sequence[Candidate], effect: str) -> tuple[float, list[Rival]]:
    """What an effect gains beside all the others, and which other ones would do in its place, how well."""
    ledger = trial.ledger
    others = [c for c in chosen if c.effect != effect]
    before = trial.unseen(others)
    taken = trial.compare([*others, *(c for c in chosen if c.effect == effect)], before)
    known = {c.effect for c in chosen}
    free = [c for c in ledger.candidates if c.effect not in known and not c.effect.startswith(PREFIX)]
    free = [c for c in free if c.effect != DRIFT or not own_levels(c.shape)]  # levels alone are no rival
    free.sort(key=lambda c: trial.explained([*others, c]), reverse=True)
    best: dict[str, Score] = {}
    for candidate in free[:SHORTLIST]:
        score = trial.score(others, before, candidate)
        if candidate.effect not in best or score.gain > best[candidate.effect].gain:
            best[candidate.effect] = score
    coefficients = sum(ledger.coefficients(c) for c in chosen if c.effect == effect)
    found = []
    for name, score in best.items():
        # one with more coefficients must be better by as much as a further hypothesis must
        handicap = UNDECIDED if ledger.coefficients(score.candidate) > coefficients else 0.0
        confidence = float(norm.sf(paired(taken.squares, score.squares) + handicap))
        if score.gain > 0.0:
            found.append(Rival(name, confidence, score.gain / max(taken.gain, 1e-12)))
    return taken.gain, sorted(found, key=lambda rival: rival.share, reverse=True)


def merged(chosen: Sequence[Candidate]) -> list[tuple[str, list[Candidate]]]:
    """The chosen hypotheses by effect: two ways of presliding are one presliding."""
    return [(name, [c for c in chosen if c.effect == name]) for name in names(chosen)]


class Said(NamedTuple):
    """What was chosen, in words and numbers."""

    findings: list[Finding]
    minor: list[Finding]
    """In the model, but too small or too doubtful to be named."""
    base: dict[str, Estimate]
    timing: tuple[str, Shape] | None
    """How it was modelled."""
    timing_s: float
    """Of the channels, where it is below a sample and so no physics; 0 = none."""


def said(
    final: Difference,
    chosen: list[Candidate],
    contests: dict[str, tuple[float, list[Rival]]],
    train: Index,
    held: Index,
) -> Said:
    """Each effect with its parameters, rivals and worth; what lies below the resolution is left unsaid."""
    ledger = final.ledger
    values, totals = estimates(final, chosen, train), ledger.totals(train)
    period_s, sharp_m = final.scenes[0].period_s, reversal_way_m(final.scenes)

    def held_out(model: Sequence[Candidate]) -> float:
        slots = ledger.slots(model)
        return float(ledger.squares(slots, ledger.solve(slots, totals), held).sum())

    best, none = held_out(chosen), held_out([])
    found: list[Finding] = []
    timing, timing_s = None, 0.0
    for effect, own in merged(chosen):
        if effect in TIMING and abs(values.of[own[0]]["time_s"].value) < period_s:
            timing, timing_s = (effect, own[0].shape), values.of[own[0]]["time_s"].value
            continue
        if effect == "presliding_hysteresis" and max(c.shape[0] for c in own) < sharp_m:
            continue
        gain, others = contests[effect]
        alike = [r.effect for r in others if r.confidence > norm.sf(UNDECIDED)]
        parameters = {}
        for number, candidate in enumerate(own, start=1):
            end = f"_{number}" if len(own) > 1 else ""
            parameters.update({key + end: estimate for key, estimate in values.of[candidate].items()})
        worth = 1.0 - best / max(held_out([c for c in chosen if c.effect != effect]), 1e-300)
        strange = effect.startswith(PREFIX)  # it may have changed in a stretch that was held out
        entry = meaning_of(effect)
        found.append(
            Finding(
                "unknown" if strange else effect,
                final.sense.value,
                confidence(
                    max([r.confidence for r in others], default=0.0), max(gain, worth) if strange else worth
                ),
                [*dict.fromkeys([*entry.EQUIVALENT, *alike])],
                others,
                own,
                parameters,
                gain,
                worth,
                entry.sentence({key: estimate.value for key, estimate in values.of[own[0]].items()}),
                1.0 - held_out(own) / max(none, 1e-300),
            )
        )
    named = [
        f
        for f in found
        if f.confidence >= DOUBTFUL
        and (f.heldout_gain >= LEAST_NAMED or (f.effect == "unknown" and f.gain >= LEAST_NAMED))
    ]
    return Said(named, [f for f in found if f not in named], values.base, timing, timing_s)
