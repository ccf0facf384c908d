"""Residuals of a recording under three models: nominal, refitted, and with the identified effects."""

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, Index
from reconcile.catalogue.kinds import RegressionData
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.regression_problem import RegressionProblem


class Residual(NamedTuple):
    """One recording in one residual channel, N or m; arrays (n,)."""

    source: str
    data: RegressionData
    measured: Array
    """The filtered channel itself: force, or scale less motor."""
    before: Array
    """Residual of the nominal values."""
    refitted: Array
    """Residual of the refitted values, no effect added."""
    after: Array
    """Residual with all identified effects."""
    used: NDArray[np.bool_]
    """Samples that count: not while the filter settles; in the force, not at standstill."""
    held_out: NDArray[np.bool_]
    """Samples of held-out blocks."""


def without_traces(of: Residual) -> Residual:
    """The recording's data, which columns need, without what was computed over its time."""
    none, never = np.zeros(0), np.zeros(0, dtype=np.bool_)
    return of._replace(measured=none, before=none, refitted=none, after=none, used=never, held_out=never)


def residuals(
    found: RegressionProblem,
    sources: Sequence[str],
    models: Sequence[tuple[Sequence[CandidateTerm], Array]],
    held_out_blocks: Index,
) -> list[Residual]:
    """Compute the residuals of each recording.

    `models`: before, refitted and after, each with its terms and normalised coefficients.
    """
    found_residuals = []
    for index, (source, data) in enumerate(zip(sources, found.datasets, strict=True)):
        y, by_model = found.target(index), []
        for chosen, theta in models:
            slots = found.equations.slots(chosen)
            weights = found.equations.denormalised(slots, theta)
            own = [
                (column, float(weight))
                for (column, recording), weight in zip(slots, weights, strict=True)
                if recording in (-1, index)
            ]
            by_model.append(y - found.prediction(index, own))
        before, refitted, after = by_model
        held_out = np.isin(found.block_of[index], held_out_blocks)
        found_residuals.append(
            Residual(
                source=source,
                data=data,
                measured=y,
                before=before,
                refitted=refitted,
                after=after,
                used=found.used[index],
                held_out=held_out,
            )
        )
    return found_residuals


def rms(of: Sequence[Residual], model: Literal["refitted", "after"]) -> float:
    """Root mean square over the samples in use of all recordings, N or m."""
    by_model: list[Array] = [getattr(residual, model)[residual.used] ** 2 for residual in of]
    return float(np.sqrt(np.mean(np.concatenate(by_model))))


def rms_between(before: float, after: float) -> float:
    """RMS of what was removed from a residual, if what is left is independent of it; 0 where nothing was."""
    return math.sqrt(max(before**2 - after**2, 0.0))
