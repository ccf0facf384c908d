"""Parameters of the selected terms in SI, with 95 % intervals by resampling blocks (block bootstrap)."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, Index
from reconcile.catalogue.registry import TIMING, declared_intervals, systematic
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.unnamed_terms import meaning_of
from reconcile.identification.confidence import INDEPENDENT_S
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.regression_data import stride
from reconcile.regression.regression_problem import RegressionProblem

RESAMPLES = 400
"""Bootstrap resamples of the blocks for the 95 % intervals."""
RIDGES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
"""Ridges in the order of trial, as shares of the target's squares; chosen."""
ANGLE_SUFFIX = "_rad"
"""End of the names of angles, whose intervals wrap."""
HOLD_DELAY_SAMPLES = 0.5
"""A zero-order hold delays the force by half a sample. A recording does not say whether its force is held
until the instant of the sample or from then on: a delay is uncertain by this either way."""


class Estimate(NamedTuple):
    """A parameter in SI with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str


class Estimates(NamedTuple):
    """All parameters of a model."""

    base: dict[str, Estimate]
    of_term: dict[CandidateTerm, dict[str, Estimate]]


def estimates(
    problem: RegressionProblem, chosen: Sequence[CandidateTerm], blocks: Index, resamples: int = RESAMPLES
) -> Estimates:
    """Fit the model to `blocks`; intervals have no width if `resamples` is 0.

    Of a coefficient free in each recording, the first recording's is reported; of an unnamed term, that of
    the recording in which it is largest, with this recording's number from 1.
    """
    equations = problem.equations
    slots = equations.slots(chosen)

    rng, fitted = np.random.default_rng(0), _smallest_equivalent(problem, slots, blocks)
    drawn = [rng.choice(blocks, len(blocks)) for _ in range(resamples)]
    resampled: Sequence[Array] = []
    if drawn:
        resampled = [*equations.denormalised(slots, equations.solve_each(slots, drawn))]
    base = {}
    for place, (column, own) in enumerate(slots):
        if column < len(equations.baseline_is_free) and own < 1:
            name, value = problem.baseline_names[column], float(fitted[place])
            interval = _percentile_interval(value, [float(one[place]) for one in resampled], name)
            base[name] = Estimate(value, *interval, "")
    by_term: dict[CandidateTerm, dict[str, Estimate]] = {}
    for candidate, places in equations.placed(chosen):
        width, first = len(candidate.columns), places.start
        sizes = np.linalg.norm(fitted[first : places.stop].reshape(-1, width), axis=1)
        unnamed_per_recording = candidate.per_recording and candidate.effect.startswith(PREFIX)
        number = int(sizes.argmax()) if unnamed_per_recording else 0
        part = slice(first + number * width, first + (number + 1) * width)
        meaning, shape = meaning_of(candidate.effect).parameters, candidate.shape_parameters
        spread = [meaning(shape, one[part]) for one in resampled]
        by_term[candidate] = {}
        for key, (value, unit) in meaning(shape, fitted[part]).items():
            low, high = _percentile_interval(value, [other[key].value for other in spread], key)
            if low < high and not key.endswith(ANGLE_SUFFIX):
                under, over = systematic(candidate.effect, key, problem.channel)
                period_s = problem.datasets[0].period_s if candidate.effect in TIMING else 0.0
                hold_s = HOLD_DELAY_SAMPLES * period_s
                low -= under * abs(value) + hold_s
                high += over * abs(value) + hold_s
            by_term[candidate][key] = Estimate(value, low, high, unit)
        values = {key: one.value for key, one in by_term[candidate].items()}
        given = {key: (one.low, one.high) for key, one in by_term[candidate].items()}
        declared = declared_intervals(candidate.effect, values, given, problem.datasets) if drawn else {}
        for key, (low, high) in declared.items():
            by_term[candidate][key] = by_term[candidate][key]._replace(low=low, high=high)
        if unnamed_per_recording:
            by_term[candidate]["recording"] = Estimate(number + 1.0, number + 1.0, number + 1.0, "")
    return Estimates(base, by_term)


def _smallest_equivalent(problem: RegressionProblem, slots: list[tuple[int, int]], blocks: Index) -> Array:
    """Coefficients (k,) by the largest ridge whose fit is worse by at most a standard error, not normalised.

    Nearly collinear columns get large coefficients of opposite signs, which cancel in this motion and in no
    other. Source: the one-standard-error rule of Hastie, Tibshirani and Friedman (2009),
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
        theta = equations.with_ridge(share).solve(slots, totals)
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
