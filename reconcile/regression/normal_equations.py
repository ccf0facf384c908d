"""Normal equations by block: products of all columns with one another, so that any model is a small solve.

A residual channel is modelled as y = X theta + residual. Blocks of consecutive samples are kept apart,
because a model is judged by how well it predicts blocks that it was not fitted on. A term may have
coefficients of its own in each recording.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, Index
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.candidate_term import CandidateTerm

RIDGE = 1e-10
"""Ridge on the normalised columns, as a share of the target's squares; collinear columns share their part."""
HOLDING_RIDGE = 1e12
"""Ridge that holds the coefficient of a column at a value."""
SMOOTH_RIDGE = 1e-3
"""Ridge on unnamed terms: what they share with named terms is attributed to the named ones. On levels of the
recordings as well: what all recordings have alike is the baseline's, not large coefficients that cancel."""


class BlockNormalEquations:
    """Gram matrices by block; filled by recording, so that the columns of only one are in memory."""

    def __init__(
        self,
        baseline_is_free: Sequence[bool],
        candidates: list[CandidateTerm],
        recording_of_block: Index,
        spare: int = 0,
    ) -> None:
        self.candidates = candidates
        self.by_key = {c.key: c for c in candidates}
        self.baseline_is_free = list(baseline_is_free)
        """By column of the baseline, which come first: whether each recording has its own coefficient."""
        self.recording_of_block = recording_of_block
        self.recordings = int(recording_of_block.max()) + 1
        self.samples = np.zeros(len(recording_of_block), dtype=np.int64)
        self.columns = (
            max([len(baseline_is_free) - 1, *(place for c in candidates for place in c.columns)]) + 1
        )
        """Number of columns, without `spare` ones that `extended` fills; they have no products before."""
        width = 1 + self.columns + spare
        self.gram = np.zeros((len(recording_of_block), 1 + self.columns, 1 + self.columns))
        self.border = np.zeros((len(recording_of_block), 0, 1 + self.columns))
        """(blocks, k, c + 1 + k): products of the k columns of `extended` with all."""
        self.unit = np.ones(width)
        self._ridge = np.full(width, RIDGE)
        self._centre = np.zeros(width)
        """Normalised coefficients to which the ridge draws: those that are held."""
        self._set_smooth_ridge(candidates)
        self.rows: list[Array] = []
        """(c + 1, n) of each recording: target and columns, normalised."""
        self.block: list[Index] = []
        """(n,) of each recording: block of a sample."""
        self.settled_travel_m: list[Array] = []
        """(n,) of each recording: distance since the last reversal or standstill."""

    def add(self, rows: Array, block: Index, settled_travel_m: Array) -> None:
        """Add the next recording: target and columns (c + 1, n), block and settled travel (n,)."""
        self.rows.append(rows)
        self.block.append(block)
        self.settled_travel_m.append(settled_travel_m)
        for b in np.unique(block):
            part = rows[:, block == b]
            self.samples[b] += part.shape[1]
            self.gram[b] += (part @ part.T)[: 1 + self.columns, : 1 + self.columns]

    def normalise(self) -> None:
        """Scale target and columns to a root mean square of 1, once all recordings are added.

        The columns of an unnamed term have one scale, so that the ridge holds hardly excited ones.
        """
        filled = slice(0, 1 + self.columns)  # the spare rows take no memory until they are
        squares = np.einsum("bii->i", self.gram) / max(int(self.samples.sum()), 1)
        self.unit[filled] = np.sqrt(squares)
        self._give_one_scale(self.candidates)
        self.gram /= self.unit[filled, None] * self.unit[filled]
        for rows in self.rows:
            np.divide(rows[filled], self.unit[filled, None], out=rows[filled])

    def _give_one_scale(self, candidates: Iterable[CandidateTerm]) -> None:
        for c in candidates:
            if c.effect.startswith(PREFIX):
                places = [place + 1 for place in c.columns]
                self.unit[places] = self.unit[places].max()
        self.unit[self.unit == 0.0] = 1.0  # columns without any excitation

    def held(self, coefficients: Mapping[int, float]) -> "BlockNormalEquations":
        """A copy with the coefficients of some columns held at values, before normalisation."""
        places = [column + 1 for column in coefficients]
        ridge, centre = self._ridge.copy(), self._centre.copy()
        ridge[places] = HOLDING_RIDGE
        centre[places] = np.array([*coefficients.values()]) * self.unit[places] / self.unit[0]
        return self._drawn_to(centre, ridge)

    def with_ridge(self, share: float) -> "BlockNormalEquations":
        """A copy with at least this ridge on every column, as a share of the target's squares."""
        return self._drawn_to(self._centre, np.maximum(self._ridge, share))

    def _drawn_to(self, centre: Array, ridge: Array) -> "BlockNormalEquations":
        """A copy with another ridge, which draws to other coefficients."""
        changed = copy(self)
        changed._centre, changed._ridge = centre, ridge  # noqa: SLF001 its own class
        return changed

    def extended(self, terms: Sequence[tuple[CandidateTerm, Sequence[Array]]]) -> "BlockNormalEquations":
        """The same equations with further terms, each with its columns (k, n) by recording.

        They fill the spare columns: equations that were extended before are no longer valid.
        """
        whole = copy(self)
        added = [term for term, _ in terms]
        places = [place + 1 for term in added for place in term.columns]
        if places and places[-1] >= len(self.unit):
            raise ValueError(f"{len(places)} columns do not fit in the spare ones")
        whole.candidates = [*self.candidates, *added]
        whole.by_key = {c.key: c for c in whole.candidates}
        whole._set_smooth_ridge(added)  # noqa: SLF001 its own class
        squares, used = np.zeros(len(places)), slice(0, 1 + self.columns + len(places))
        whole.border = np.zeros((len(self.gram), len(places), used.stop))
        for recording, rows in enumerate(self.rows):
            values = np.concatenate([of[recording] for _, of in terms])
            rows[places] = values
            squares += (values**2).sum(axis=1)
        self.unit[places] = np.sqrt(squares / max(int(self.samples.sum()), 1))
        self._give_one_scale(added)
        for rows, block in zip(self.rows, self.block, strict=True):
            rows[places] /= self.unit[places][:, None]
            for b in np.unique(block):
                part = rows[used, block == b]
                whole.border[b] = part[places] @ part.T
                whole.border[b][:, places] = whole.border[b][:, places].T
        return whole

    def release(self) -> None:
        """Give the memory back: nothing can be solved or extended any more."""
        self.rows.clear()
        self.gram = self.border = np.zeros((0, 0, 0))

    def _set_smooth_ridge(self, candidates: Sequence[CandidateTerm]) -> None:
        for c in candidates:
            columns = c.columns if c.effect.startswith(PREFIX) else c.levels
            self._ridge[[place + 1 for place in columns]] = SMOOTH_RIDGE

    def slots(self, chosen: Sequence[CandidateTerm]) -> list[tuple[int, int]]:
        """(column, recording) of each coefficient: base columns, then each term's; recording -1 is all."""
        slots: list[tuple[int, int]] = []
        for column, own in enumerate(self.baseline_is_free):
            slots += [(column, recording) for recording in self._recordings(own=own)]
        for candidate in chosen:
            for recording in self._recordings(own=candidate.per_recording):
                slots += [(column, recording) for column in candidate.columns]
        return slots

    def coefficients(self, candidate: CandidateTerm) -> int:
        """Number of coefficients of a term."""
        return len(candidate.columns) * len(self._recordings(own=candidate.per_recording))

    def placed(self, chosen: Sequence[CandidateTerm]) -> Iterator[tuple[CandidateTerm, range]]:
        """Yield each term with the places of its coefficients, as in `slots`."""
        first = len(self.slots([]))
        for candidate in chosen:
            following = first + self.coefficients(candidate)
            yield candidate, range(first, following)
            first = following

    def _recordings(self, *, own: bool) -> Sequence[int]:
        return range(self.recordings) if own else (-1,)

    def totals(self, blocks: Index) -> Array:
        """Sum of the blocks' Gram matrices by recording, (recordings, c + 1, c + 1)."""
        columns, width = self.gram.shape[1], self.gram.shape[1] + self.border.shape[1]
        sums = np.zeros((self.recordings, width, width))
        for b in blocks:
            of_recording = sums[self.recording_of_block[b]]
            of_recording[:columns, :columns] += self.gram[b]
            of_recording[columns:] += self.border[b]
        sums[:, :columns, columns:] = sums[:, columns:, :columns].swapaxes(1, 2)
        return sums

    def solve(self, slots: list[tuple[int, int]], totals: Array) -> Array:
        """Solve the ridge regression of `totals` (..., recordings, c + 1, c + 1) for (..., k), normalised."""
        column, active = self.places(slots)
        parts = totals[..., column[:, None], column] * (active[:, :, None] & active[:, None, :])
        a = parts.sum(axis=-3)
        g = (totals[..., column, 0] * active).sum(axis=-2)
        size = np.maximum(totals[..., 0, 0].sum(axis=-1), 1e-300)
        a += np.diag(self._ridge[column]) * size[..., None, None]
        g += self._ridge[column] * self._centre[column] * size[..., None]
        solution: Array = np.linalg.solve(a, g[..., None])[..., 0]
        return solution

    def solve_each(self, slots: list[tuple[int, int]], drawn: Sequence[Index]) -> Array:
        """Solve for each draw of blocks, which may hold a block several times, (draws, k)."""
        column, _ = self.places(slots)
        kept, place = np.unique(np.append(0, column), return_inverse=True)
        counts = np.stack([np.bincount(blocks, minlength=len(self.gram)) for blocks in drawn])
        sub = self._products(np.arange(len(self.gram)), kept).reshape(len(self.gram), -1)
        sums = np.zeros((len(drawn), self.recordings, sub.shape[1]))
        for recording in range(self.recordings):
            own = self.recording_of_block == recording
            sums[:, recording] = counts[:, own] @ sub[own]
        narrow = self._drawn_to(self._centre[kept], self._ridge[kept])
        own_slots = [(int(p) - 1, recording) for p, (_, recording) in zip(place[1:], slots, strict=True)]
        return narrow.solve(own_slots, sums.reshape(*sums.shape[:2], len(kept), len(kept)))

    def squares(self, slots: list[tuple[int, int]], theta: Array, blocks: Index) -> Array:
        """Sum of squared residuals of each block (b,), in units of y; `theta` (k,) or by block (b, k)."""
        column, active = self.places(slots)
        of_block = (
            np.broadcast_to(theta, (len(blocks), len(column))) * active[self.recording_of_block[blocks]]
        )
        weights = np.concatenate((np.ones((len(blocks), 1)), -of_block), axis=1)
        places = np.concatenate(([0], column))
        sub = self._products(blocks, places)
        squared = np.einsum("bi,bij,bj->b", weights, sub, weights)
        squares: Array = np.maximum(squared, 0.0) * self.unit[0] ** 2
        return squares

    def _products(self, blocks: Index, places: Index) -> Array:
        """Products (b, k, k) of the rows at `places` in each block."""
        columns = self.gram.shape[1]
        row, column = np.broadcast_arrays(places[:, None], places)
        row, column = np.where(row < columns, (column, row), (row, column))  # a border has the later rows
        own, blocks = row < columns, blocks[:, None]
        found = np.empty((len(blocks), *own.shape))
        found[:, own] = self.gram[blocks, row[own], column[own]]
        found[:, ~own] = self.border[blocks, row[~own] - columns, column[~own]]
        return found

    def places(self, slots: list[tuple[int, int]]) -> tuple[Index, NDArray[np.bool_]]:
        """Row of each coefficient in the Gram matrix (k,), and whether a recording has it (recordings, k)."""
        recording = np.array([slot[1] for slot in slots])
        active = (recording < 0) | (recording == np.arange(self.recordings)[:, None])
        return np.array([slot[0] + 1 for slot in slots]), active

    def denormalised(self, slots: list[tuple[int, int]], theta: Array) -> Array:
        """Coefficients of the columns before normalisation."""
        coefficients: Array = theta * self.unit[0] / self.unit[[slot[0] + 1 for slot in slots]]
        return coefficients
