"""From selected terms to reported effects: parameters with intervals, rivals, confidence, held-out gain."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from kernels.arrays import Array, Index
from reconcile.catalogue.kinds import ShapeParameters
from reconcile.catalogue.registry import ENTRIES, TIMING, has_levels, systematic
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.unnamed_terms import meaning_of
from reconcile.identification.confidence import INDEPENDENT_S, confidence
from reconcile.regression.normal_equations import CandidateTerm, effect_names
from reconcile.regression.regression_data import stride
from reconcile.regression.regression_problem import RegressionProblem
from reconcile.regression.resolution import reversal_travel_m
from reconcile.selection.cross_validation import SHORTLIST, CrossValidation, paired

RESAMPLES = 400
"""Bootstrap resamples of the blocks for the 95 % intervals."""
RIDGES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
"""Ridges that are tried, the largest first, as shares of the target's squares."""
ANGLE_SUFFIX = "_rad"
"""Parameters of that name are angles: their intervals wrap."""
LEAST_REPORTED_GAIN = 0.1
"""Least share of the unexplained held-out variance of a reported effect."""
HOLD_DELAY_SAMPLES = 0.5
"""A zero-order hold delays the force by half a sample. Delay estimates may or may not include it."""
LEAST_CONFIDENCE = 0.4
"""Least confidence of a reported effect: below, a rival is the more probable name."""
RIVAL_STANDARD_ERRORS = 2.0
"""A rival whose cross-validated squares are worse by less, in standard errors, is indistinguishable."""


class Estimate(NamedTuple):
    """A parameter in SI with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str


class RivalEffect(NamedTuple):
    """Another effect that could explain the data in place of the identified one."""

    effect: str
    confidence: float
    """Probability that it predicts held-back blocks better."""
    share: float
    """Its gain over that of the identified effect."""


class IdentifiedEffect(NamedTuple):
    """An effect that the nominal model lacks."""

    effect: str
    channel: str
    confidence: float
    equivalent: list[str]
    rivals: list[RivalEffect]
    candidates: list[CandidateTerm]
    parameters: dict[str, Estimate]
    gain: float
    """Share of the unexplained variance that it explains, cross-validated."""
    heldout_gain: float
    explanation: str
    share: float = 0.0
    """Share of the held-out variance that it explains alone; findings are ranked by it."""


class Estimates(NamedTuple):
    """All parameters of a model, with 95 % intervals by resampling blocks (block bootstrap)."""

    base: dict[str, Estimate]
    of: dict[CandidateTerm, dict[str, Estimate]]


def estimates(
    problem: RegressionProblem, chosen: Sequence[CandidateTerm], blocks: Index, resamples: int = RESAMPLES
) -> Estimates:
    """Fit on `blocks`. Of a coefficient free in each recording, the first one's is reported.

    Without `resamples` the intervals are as narrow as the values. Of a term without a name, that of the
    recording in which it is largest, and that one's number from 1.
    """
    equations = problem.equations
    slots = equations.slots(chosen)

    rng, fitted = np.random.default_rng(0), _smallest_alike(problem, slots, blocks)
    drawn = [rng.choice(blocks, len(blocks)) for _ in range(resamples)]
    resampled: Sequence[Array] = []
    if drawn:
        resampled = [*equations.denormalised(slots, equations.solve_each(slots, drawn))]
    base = {}
    for place, (column, own) in enumerate(slots):
        if column < len(equations.base) and own < 1:
            name, value = problem.baseline_names[column], float(fitted[place])
            interval = _percentile_interval(value, [float(one[place]) for one in resampled], name)
            base[name] = Estimate(value, *interval, "")
    found: dict[CandidateTerm, dict[str, Estimate]] = {}
    first = len(equations.slots([]))
    for candidate in chosen:
        width, count = len(candidate.columns), equations.coefficients(candidate)
        sizes = np.linalg.norm(fitted[first : first + count].reshape(-1, width), axis=1)
        of_one = candidate.per_recording and candidate.effect.startswith(PREFIX)
        number = int(sizes.argmax()) if of_one else 0
        part = slice(first + number * width, first + (number + 1) * width)
        first += count
        meaning, shape = meaning_of(candidate.effect).parameters, candidate.shape_parameters
        spread = [meaning(shape, one[part]) for one in resampled]
        found[candidate] = {}
        for key, (value, unit) in meaning(shape, fitted[part]).items():
            low, high = _percentile_interval(value, [other[key].value for other in spread], key)
            if low < high and not key.endswith(ANGLE_SUFFIX):
                under, over = systematic(candidate.effect, key, problem.channel)
                period_s = problem.datasets[0].period_s if candidate.effect in TIMING else 0.0
                low -= under * abs(value) + HOLD_DELAY_SAMPLES * period_s
                high += over * abs(value)
            found[candidate][key] = Estimate(value, low, high, unit)
        if of_one:
            found[candidate]["recording"] = Estimate(number + 1.0, number + 1.0, number + 1.0, "")
    return Estimates(base, found)


def _smallest_alike(problem: RegressionProblem, slots: list[tuple[int, int]], blocks: Index) -> Array:
    """The smallest coefficients among those that fit alike, within a standard error, before normalisation.

    Columns that a motion hardly tells apart get large coefficients of opposite signs, which cancel in this
    motion and in no other. Source: the one-standard-error rule of Hastie, Tibshirani and Friedman (2009),
    section 7.10, on the largest ridge.
    """
    equations = problem.equations
    totals, period_s = equations.totals(blocks), problem.datasets[0].period_s
    kept_s = stride(period_s) * period_s * float(equations.samples[blocks].sum())

    def squares(theta: Array) -> float:
        return float(equations.squares(slots, theta, blocks).sum())

    best = equations.solve(slots, totals)
    most = squares(best) * (1.0 + INDEPENDENT_S / max(kept_s, INDEPENDENT_S))
    for share in RIDGES:
        theta = equations.ridged(share).solve(slots, totals)
        if squares(theta) <= most:
            best = theta
            break
    return equations.denormalised(slots, best)


def _percentile_interval(value: float, resampled: Sequence[float], key: str) -> tuple[float, float]:
    """95 % percentile interval; angles are wrapped about their value."""
    if not resampled:
        return value, value
    spread = np.array(resampled) - value
    if key.endswith(ANGLE_SUFFIX):
        spread = (spread + math.pi) % (2.0 * math.pi) - math.pi
    low, high = np.percentile(spread, [2.5, 97.5])
    return value + float(low), value + float(high)


def compare_rivals(
    validation: CrossValidation, chosen: Sequence[CandidateTerm], effect: str
) -> tuple[float, list[RivalEffect]]:
    """Gain of an effect beside all others, and the rivals that explain something in its place, best first."""
    equations = validation.equations
    others = [c for c in chosen if c.effect != effect]
    before = validation.cross_validated_squares(others)
    own_score = validation.compare([*others, *(c for c in chosen if c.effect == effect)], before)
    chosen_effects = {c.effect for c in chosen}
    rivals_tried = [
        c
        for c in equations.candidates
        if c.effect not in chosen_effects
        and not c.effect.startswith(PREFIX)
        and not has_levels(c.effect, len(c.columns))  # levels of each recording alone are no rival
    ]
    rivals_tried.sort(key=lambda c: validation.explained([*others, c]), reverse=True)
    best: dict[str, tuple[float, CandidateTerm]] = {}
    for candidate in rivals_tried[:SHORTLIST]:
        gain = validation.gain([*others, candidate], before)
        if gain > 0.0 and (candidate.effect not in best or gain > best[candidate.effect][0]):
            best[candidate.effect] = gain, candidate
    coefficients = sum(equations.coefficients(c) for c in chosen if c.effect == effect)
    found = []
    for name, (_, candidate) in best.items():
        score = validation.score(others, before, candidate)
        # a rival with more coefficients must be better by as much as a further term must
        handicap = RIVAL_STANDARD_ERRORS if equations.coefficients(score.candidate) > coefficients else 0.0
        confidence = float(norm.sf(paired(own_score.squares, score.squares) + handicap))
        found.append(RivalEffect(name, confidence, score.gain / max(own_score.gain, 1e-12)))
    return own_score.gain, sorted(found, key=lambda rival: rival.share, reverse=True)


class ReportedEffects(NamedTuple):
    """The effects of a channel, ready for the verdict."""

    findings: list[IdentifiedEffect]
    minor: list[IdentifiedEffect]
    """In the model, but too small or too uncertain to be reported."""
    base: dict[str, Estimate]
    timing: tuple[str, ShapeParameters] | None
    """Term that models a lag below one sample, if any."""
    timing_s: float
    """That lag: how the channels were sampled, no physics; 0 without one."""


def report_findings(
    problem: RegressionProblem,
    chosen: list[CandidateTerm],
    rivals: dict[str, tuple[float, list[RivalEffect]]],
    train: Index,
    held_out_blocks: Index,
    resamples: int = RESAMPLES,
) -> ReportedEffects:
    """Report each effect with parameters, rivals and held-out gain, unless it is below the resolution.

    What is left out of the fit judges it; the parameters are then those of all blocks.
    """
    equations = problem.equations
    everything = np.sort(np.concatenate((train, held_out_blocks)))
    values, totals = estimates(problem, chosen, everything, resamples), equations.totals(train)
    period_s, resolvable_m = problem.datasets[0].period_s, reversal_travel_m(problem.datasets)

    def squares_held_out(model: Sequence[CandidateTerm]) -> float:
        slots = equations.slots(model)
        return float(equations.squares(slots, equations.solve(slots, totals), held_out_blocks).sum())

    kept_s = stride(period_s) * period_s
    held_out_s = float(equations.samples[held_out_blocks].sum()) * kept_s
    best, unexplained = squares_held_out(chosen), squares_held_out([])
    found: list[IdentifiedEffect] = []
    timing, timing_s = None, 0.0
    for effect in effect_names(chosen):
        own = [c for c in chosen if c.effect == effect]
        first = {key: estimate.value for key, estimate in values.of[own[0]].items()}
        if effect in TIMING and abs(first["time_s"]) < period_s:
            timing, timing_s = (effect, own[0].shape_parameters), first["time_s"]
            continue
        unnamed = effect.startswith(PREFIX)
        ends_with_reversal = not unnamed and ENTRIES[effect].ends_with_reversal
        if ends_with_reversal and max(c.shape_parameters[0] for c in own) < resolvable_m:
            continue
        gain, others = rivals[effect]
        indistinguishable = [r.effect for r in others if r.confidence > norm.sf(RIVAL_STANDARD_ERRORS)]
        parameters = {}
        for number, candidate in enumerate(own, start=1):
            end = f"_{number}" if len(own) > 1 else ""
            parameters.update({key + end: estimate for key, estimate in values.of[candidate].items()})
        heldout_gain = 1.0 - best / max(squares_held_out([c for c in chosen if c.effect != effect]), 1e-300)
        # what has no name may have changed within a held-out stretch, so its gain counts too
        judged_gain = max(gain, heldout_gain) if unnamed else heldout_gain
        meaning = meaning_of(effect)
        found.append(
            IdentifiedEffect(
                effect="unknown" if unnamed else effect,
                channel=problem.channel.value,
                confidence=confidence(
                    max([r.confidence for r in others], default=0.0), judged_gain, held_out_s
                ),
                equivalent=[*dict.fromkeys([*meaning.equivalent, *indistinguishable])],
                rivals=others,
                candidates=own,
                parameters=parameters,
                gain=gain,
                heldout_gain=heldout_gain,
                explanation=meaning.sentence(first),
                share=1.0 - squares_held_out(own) / max(unexplained, 1e-300),
            )
        )
    minor = [
        f
        for f in found
        if f.confidence < LEAST_CONFIDENCE
        or max(f.heldout_gain, f.gain if f.effect == "unknown" else 0.0) < LEAST_REPORTED_GAIN
    ]
    named = [f for f in found if f not in minor]
    return ReportedEffects(named, minor, values.base, timing, timing_s)
