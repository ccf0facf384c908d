"""The ledger: products of all columns with one another, block by block, so that any model is a small solve.

A difference between model and recording (`Sense`) is y = X theta + rest. Blocks of consecutive samples are
kept apart, for what counts is how well a model predicts blocks that it was not fitted on. A hypothesis may
have coefficients of its own in each recording.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.smooth_terms import PREFIX

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Shape

    Array = NDArray[np.float64]
    Index = NDArray[np.int64]
    Key = tuple[str, Shape, bool]

RIDGE = 1e-10
"""Of the mean square of a column: collinear columns share their part instead of blowing up."""
SMOOTH_RIDGE = 1e-5
"""Of a smooth term: what it has in common with the model's own columns is left to them."""


class Candidate(NamedTuple):
    """A hypothesis with its columns' places in the ledger."""

    effect: str
    shape: Shape
    per_recording: bool
    columns: tuple[int, ...]

    @property
    def key(self) -> Key:
        """What it is, in whatever ledger its columns stand."""
        return self.effect, self.shape, self.per_recording


class Ledger:
    """Filled recording by recording, so that the columns of all of them never stand in memory at once."""

    def __init__(self, base: Sequence[bool], candidates: list[Candidate], recording_of_block: Index) -> None:
        self.candidates = candidates
        self.by_key = {c.key: c for c in candidates}
        self.base = list(base)
        """The first columns are those of every model; True: free in each recording."""
        self.recording_of_block = recording_of_block
        self.recordings = int(recording_of_block.max()) + 1
        self.samples = np.zeros(len(recording_of_block), dtype=np.int64)
        width = 1 + max([len(base) - 1, *(place for c in candidates for place in c.columns)]) + 1
        self.gram = np.zeros((len(recording_of_block), width, width))
        self.unit = np.ones(width)
        self._ridge = np.full(width, RIDGE)
        for c in candidates:
            if c.effect.startswith(PREFIX):
                self._ridge[[place + 1 for place in c.columns]] = SMOOTH_RIDGE
        self.rows: list[Array] = []
        """(c + 1, n) of each recording: what is to be explained, and the columns, normalised."""
        self.block: list[Index] = []
        """(n,) of each recording."""
        self.way_m: list[Array] = []
        """(n,) of each recording: what lies between a sample and the last reversal or rest."""

    def add(self, y: Array, columns: Array, block: Index, way_m: Array) -> None:
        """Samples (n,) of the next recording: `columns` (n, c), block of each, its way since the reversal."""
        self.rows.append(np.ascontiguousarray(np.concatenate((y[:, None], columns), axis=1).T))
        self.block.append(block)
        self.way_m.append(way_m)
        for b in np.unique(block):
            part = self.rows[-1][:, block == b]
            self.samples[b] += part.shape[1]
            self.gram[b] += part @ part.T

    def normalise(self) -> None:
        """Once all is added: columns in units of their own RMS."""
        squares = np.einsum("bii->i", self.gram) / max(int(self.samples.sum()), 1)
        self.unit = np.where(squares > 0.0, np.sqrt(squares), 1.0)
        self.gram /= self.unit[:, None] * self.unit
        self.rows = [rows / self.unit[:, None] for rows in self.rows]

    def slots(self, chosen: Sequence[Candidate]) -> list[tuple[int, int]]:
        """The coefficients of a model: base columns, then each candidate's."""
        slots: list[tuple[int, int]] = []
        for column, own in enumerate(self.base):
            slots += [(column, recording) for recording in self._recordings(own=own)]
        for candidate in chosen:
            for recording in self._recordings(own=candidate.per_recording):
                slots += [(column, recording) for column in candidate.columns]
        return slots

    def coefficients(self, candidate: Candidate) -> int:
        """So many a candidate has."""
        return len(candidate.columns) * len(self._recordings(own=candidate.per_recording))

    def _recordings(self, *, own: bool) -> Sequence[int]:
        return range(self.recordings) if own else (-1,)

    def totals(self, blocks: Index) -> Array:
        """Sums of the blocks' products by recording, (recordings, c + 1, c + 1)."""
        sums = np.zeros((self.recordings, *self.gram.shape[1:]))
        for b in blocks:
            sums[self.recording_of_block[b]] += self.gram[b]
        return sums

    def solve(self, slots: list[tuple[int, int]], totals: Array) -> Array:
        """Least squares for sums of blocks (..., recordings, c + 1, c + 1); of normalised columns."""
        column, active = self.places(slots)
        parts = totals[..., column[:, None], column] * (active[:, :, None] & active[:, None, :])
        a = parts.sum(axis=-3)
        g = (totals[..., column, 0] * active).sum(axis=-2)
        size = np.maximum(totals[..., 0, 0].sum(axis=-1), 1e-300)
        a += np.diag(self._ridge[column]) * size[..., None, None]
        solution: Array = np.linalg.solve(a, g[..., None])[..., 0]
        return solution

    def squares(self, slots: list[tuple[int, int]], theta: Array, blocks: Index) -> Array:
        """Sum of squares of the rest, in units of y, for each block; `theta` (k,) or by block (b, k)."""
        column, active = self.places(slots)
        of_block = (
            np.broadcast_to(theta, (len(blocks), len(column))) * active[self.recording_of_block[blocks]]
        )
        weights = np.concatenate((np.ones((len(blocks), 1)), -of_block), axis=1)
        places = np.concatenate(([0], column))
        sub = self.gram[blocks[:, None, None], places[:, None], places]
        found = np.einsum("bi,bij,bj->b", weights, sub, weights)
        squares: Array = np.maximum(found, 0.0) * self.unit[0] ** 2
        return squares

    def places(self, slots: list[tuple[int, int]]) -> tuple[Index, NDArray[np.bool_]]:
        """Of each coefficient: its place in the products (k,), and whether a recording has it (r, k)."""
        recording = np.array([slot[1] for slot in slots])
        active = (recording < 0) | (recording == np.arange(self.recordings)[:, None])
        return np.array([slot[0] + 1 for slot in slots]), active

    def real(self, slots: list[tuple[int, int]], theta: Array) -> Array:
        """Coefficients of the columns as they were given."""
        coefficients: Array = theta * self.unit[0] / self.unit[[slot[0] + 1 for slot in slots]]
        return coefficients


def names(chosen: Sequence[Candidate]) -> list[str]:
    """The effects, each once, in their order."""
    return list(dict.fromkeys(candidate.effect for candidate in chosen))
