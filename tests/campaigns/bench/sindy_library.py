"""The library for PySINDy: every law of the catalogue on its whole grid, as columns of one regression.

The columns, the filter, the samples that count and the quarter held out are those of `reconcile` itself, so
that only the choice of terms differs. A law whose phase is re-zeroed with the encoder has columns of its own
in each recording. What every model has (mass, viscous, Coulomb; origin, delay) is projected out and never
thresholded.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks, periodogram

from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.kinds import RegressionData, ResidualChannel, ShapeParameters
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.regression_problem import RegressionProblem, regression_problem

Index = NDArray[np.int64]

FREQUENCIES = 6
HIGHEST_HZ = 60.0
JITTER = 1e-12


class Term(NamedTuple):
    """A law with its parameters fixed."""

    effect: str
    shape: ShapeParameters
    slots: tuple[int, ...]
    """Its columns in the library."""


class Library:
    """Sums of products of all columns for each block of samples: all that least squares asks for."""

    def __init__(
        self, datasets: Sequence[RegressionData], channel: ResidualChannel, known: Sequence[ModelTerm] = ()
    ) -> None:
        """`known`: what the model file has already, which is taken off as `reconcile` takes it off."""
        lines = _frequencies(datasets) if channel is ResidualChannel.FORCE else []
        found = regression_problem(datasets, channel, lines, model_terms=known)
        equations = found.equations
        self.samples, self._recording, self._gram = (
            equations.samples,
            equations.recording_of_block,
            equations.gram,
        )
        self._unit, self.terms = equations.unit, []
        slots = equations.slots([])
        self.base = len(slots)
        own = {(c.effect, c.shape_parameters) for c in equations.candidates if c.per_recording}
        for c in equations.candidates:
            if c.effect.startswith(PREFIX) or (not c.per_recording and (c.effect, c.shape_parameters) in own):
                continue
            first = len(slots)
            for recording in range(equations.recordings) if c.per_recording else (-1,):
                slots += [(column, recording) for column in c.columns]
            self.terms.append(Term(c.effect, c.shape_parameters, tuple(range(first, len(slots)))))
        self._column = np.array([0, *(column + 1 for column, _ in slots)])
        self._owner = np.array([-1, *(recording for _, recording in slots)])

    def quarters(self) -> tuple[Index, Index, Index]:
        """Blocks to fit on, to choose by, and held out: two, one and one quarter of every recording."""
        parts: tuple[list[Index], list[Index], list[Index]] = ([], [], [])
        for recording in np.unique(self._recording):
            own = np.flatnonzero((self._recording == recording) & (self.samples > 0))
            last = max(round(0.75 * len(own)), 1)
            middle = max(round(2 * last / 3), 1)
            for part, blocks in zip(parts, np.split(own, (middle, last)), strict=True):
                part.append(blocks)
        fit, choose, held = (np.concatenate(part) for part in parts)
        return fit, choose, held

    def products(self, blocks: Index) -> Array:
        """(1 + slots, 1 + slots) of these blocks, the difference itself first."""
        whole = np.zeros((len(self._column), len(self._column)))
        for recording in np.unique(self._recording[blocks]):
            total = self._gram[blocks[self._recording[blocks] == recording]].sum(axis=0)
            here = np.flatnonzero((self._owner < 0) | (self._owner == recording))
            column = self._column[here]
            whole[here[:, None], here] += total[column[:, None], column]
        return whole

    def coefficient(self, term: Term, theta: Array) -> float:
        """The first coefficient of a term, of its column as it was given."""
        slot = term.slots[0]
        return float(theta[slot] * self._unit[0] / self._unit[self._column[slot + 1]])

    def rms(self, squares: float, blocks: Index) -> float:
        """SI."""
        return float(np.sqrt(max(squares, 0.0) / max(int(self.samples[blocks].sum()), 1)) * self._unit[0])


def rows(products: Array, base: int) -> tuple[Array, Array, Array]:
    """Rows X, y with the products of the samples' own rows, base projected out, columns of unit length.

    Least squares, ridge and every threshold give on them what they give on the samples: X'X and X'y agree.
    """
    b, rest = slice(1, 1 + base), np.r_[0, 1 + base : len(products)]
    cross = products[b, rest]
    inner = products[b, b] + JITTER * np.eye(base) * np.trace(products[b, b])
    left = products[np.ix_(rest, rest)] - cross.T @ np.linalg.solve(inner, cross)
    length = np.sqrt(np.maximum(np.diag(left), 0.0))
    full = products[rest, rest]
    usable = length**2 > 1e-9 * np.maximum(full, 1e-300)
    scale = np.where(usable, 1.0 / np.where(usable, length, 1.0), 0.0)
    values, vectors = np.linalg.eigh(left * scale[:, None] * scale)
    kept = values > JITTER * values[-1]
    root = np.sqrt(values[kept])[:, None] * vectors[:, kept].T
    return root[:, 1:], root[:, 0], usable[1:]


def _frequencies(datasets: Sequence[RegressionData]) -> list[tuple[str, ShapeParameters]]:
    """The strongest lines in the spectrum of what a rigid axis leaves: the grid of a disturbance in time."""
    bare: RegressionProblem = regression_problem(datasets, ResidualChannel.FORCE, only=True)
    strength: dict[float, float] = {}
    for index, data in enumerate(datasets):
        y, columns = bare.target_and_columns(index)
        used = bare.used[index]
        theta, *_ = np.linalg.lstsq(columns[used], y[used], rcond=None)
        left = np.where(used, y - columns @ theta, 0.0)
        hertz, power = periodogram(left, 1.0 / data.period_s, window="hann")
        near = (hertz > 1.0) & (hertz < HIGHEST_HZ)
        hertz, power = hertz[near], power[near]
        peaks, _ = find_peaks(power)
        for peak in peaks[np.argsort(power[peaks])[-FREQUENCIES:]]:
            strength[float(hertz[peak])] = float(power[peak] / np.median(power))
    best = sorted(strength, key=strength.__getitem__, reverse=True)[:FREQUENCIES]
    return [("periodic_disturbance", (hertz,)) for hertz in sorted(best)]
