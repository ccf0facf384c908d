"""Which effects predict recordings that they were not fitted on; the others are withdrawn.

Cross-validation by short blocks asks whether a term predicts the same motion a moment later. A term that
follows the misfit of one recording passes it. Here each recording is left out in turn, or each third of an
only one: an effect must make the prediction of what was left out better.
Source: Roberts et al. (2017), blocking in cross-validation by the structure of the data.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, Index
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.candidate_term import CandidateTerm, effect_names
from reconcile.regression.normal_equations import BlockNormalEquations

PARTS_OF_ONE = 3
"""Stretches that an only recording is cut into."""
STRETCH_BLOCKS = 4
"""Blocks of a stretch of a left-out recording, by which its own coefficients are fitted and judged."""
MOST_LEVERAGE = 20.0
"""Mean leverage of a block over that of the blocks that predict it, above which its prediction is an
extrapolation, as from 24 K of warming to 45 K. Similar motions stay below 10. Chosen."""
LEAST_JUDGED = 0.2
"""Share of blocks that are no extrapolation, below which an effect is judged on thirds of each recording."""
LEAST_GAIN = 0.01
"""Least share of the left-out squares that an effect removes: that of a term in `SelectionRules`."""


class Withdrawn(NamedTuple):
    """An effect that was selected, but does not predict what was left out, or is physically impossible."""

    effect: str
    why: str
    """In words, for the report."""


def left_out_parts(equations: BlockNormalEquations, blocks: Index) -> list[Index]:
    """The blocks of each recording; of an only one, those of each third."""
    recordings = equations.recording_of_block[blocks]
    present = np.unique(recordings)
    if len(present) == 1:
        return [part for part in np.array_split(blocks, PARTS_OF_ONE) if len(part)]
    return [blocks[recordings == recording] for recording in present]


def left_out_squares_by_block(
    equations: BlockNormalEquations, chosen: Sequence[CandidateTerm], parts: Sequence[Index]
) -> Array:
    """Squared residuals of each block, predicted from the other parts, in the order of the parts.

    Coefficients that a recording has of its own (an origin, a phase, a level) are fitted on every other
    stretch of it, and predict those in between; a recording of one block is predicted without them. Those of
    unnamed terms are fitted on all of the recording, because no name depends on them.
    """
    named = [c for c in chosen if not c.effect.startswith(PREFIX)]
    slots = equations.slots([*named, *(c for c in chosen if c not in named)])
    first_unnamed = len(equations.slots(named))
    found: list[Array] = []
    for place, part in enumerate(parts):
        others = np.concatenate([other for number, other in enumerate(parts) if number != place])
        elsewhere = set(equations.recording_of_block[others].tolist())
        theta = equations.solve(slots, equations.totals(others))
        own = [i for i, (_, recording) in enumerate(slots) if recording not in {-1, *elsewhere}]
        judged = [i for i in own if i < first_unnamed]
        if len(judged) < len(own):
            _fit_own(equations, slots, theta, own, part)
        halves = _interleaved(part) if judged else [part]
        of_part = np.zeros(len(part))
        for number, half in enumerate(halves):
            if len(halves) > 1:
                _fit_own(equations, slots, theta, judged, halves[1 - number])
            of_part[np.isin(part, half)] = equations.squares(slots, theta, half)
        found.append(of_part)
    return np.concatenate(found)


def predictive_terms(
    equations: BlockNormalEquations, chosen: Sequence[CandidateTerm], blocks: Index
) -> tuple[list[CandidateTerm], list[Withdrawn]]:
    """The terms without the effects that do not predict what is left out, the worst withdrawn first.

    Unnamed terms must predict it too. They are dropped without a reason for the report, which states the
    unexplained residual as such. Unnamed terms that each recording has of its own are exempt.
    """
    kept, withdrawn = list(chosen), []
    parts = left_out_parts(equations, blocks)
    alone = len(np.unique(equations.recording_of_block[blocks])) == 1
    thirds = _thirds_of_each(parts)
    while len(parts) > 1:
        whole = left_out_squares_by_block(equations, kept, parts)
        gains = {}
        for effect in effect_names(kept):
            others = [c for c in kept if c.effect != effect]
            if effect.startswith(PREFIX) and any(c.per_recording for c in kept if c.effect == effect):
                continue
            predictable = _predictable_blocks(equations, kept, effect, parts)
            if predictable.mean() >= LEAST_JUDGED:
                with_it, without = whole, left_out_squares_by_block(equations, others, parts)
            else:
                with_it, without = (left_out_squares_by_block(equations, of, thirds) for of in (kept, others))
                predictable = np.ones(len(without), dtype=np.bool_)
            squares, squares_without = (float(of[predictable].sum()) for of in (with_it, without))
            gains[effect] = 1.0 - squares / max(squares_without, 1e-300)
        worst = min(gains, key=lambda effect: gains[effect], default=None)
        if worst is None or gains[worst] >= LEAST_GAIN:
            break
        kept = [c for c in kept if c.effect != worst]
        if not worst.startswith(PREFIX):
            withdrawn.append(Withdrawn(worst, _why(gains[worst], len(parts), alone=alone)))
    return kept, withdrawn


def _predictable_blocks(
    equations: BlockNormalEquations, chosen: Sequence[CandidateTerm], effect: str, parts: Sequence[Index]
) -> NDArray[np.bool_]:
    """Blocks (blocks,) in which an effect is excited no more than in the other parts, by their leverage.

    All of them, where each recording has coefficients of its own.
    """
    own = [c for c in chosen if c.effect == effect]
    blocks = np.concatenate(parts)
    if any(c.per_recording for c in own):
        return np.ones(len(blocks), dtype=np.bool_)
    columns = [1 + place for c in own for place in c.columns]
    beside = [1 + place for place in range(len(equations.baseline_is_free))]
    beside += [1 + place for c in chosen if c.effect != effect for place in c.columns]
    places = np.array([*beside, *columns])
    found: list[NDArray[np.bool_]] = []
    for number, part in enumerate(parts):
        others = np.concatenate([other for k, other in enumerate(parts) if k != number])
        gram = equations.gram[np.ix_(others, places, places)].sum(axis=0)
        first = len(beside)
        alone = np.concatenate(
            (-np.linalg.pinv(gram[:first, :first]) @ gram[:first, first:], np.eye(len(columns)))
        )
        inverse = np.linalg.pinv(alone.T @ gram @ alone)
        products = equations.gram[np.ix_(part, places, places)]
        leverage = np.einsum("ij,ki,bkl,lj->b", inverse, alone, products, alone)
        mean = len(columns) / max(float(equations.samples[others].sum()), 1.0)
        found.append(leverage <= MOST_LEVERAGE * mean * equations.samples[part])
    return np.concatenate(found)


def _thirds_of_each(parts: Sequence[Index]) -> list[Index]:
    """The first third of all parts, the second and the last."""
    cut = [np.array_split(part, PARTS_OF_ONE) for part in parts]
    return [third for third in map(np.concatenate, zip(*cut, strict=True)) if len(third)]


def _interleaved(part: Index) -> list[Index]:
    """Every other stretch of a recording, and those in between; a single block stays alone."""
    odd = np.arange(len(part)) // STRETCH_BLOCKS % 2 == 1
    return [part[~odd], part[odd]] if odd.any() else np.array_split(part, min(2, len(part)))


def _why(gain: float, parts: int, *, alone: bool) -> str:
    what = f"{parts} stretches" if alone else f"{parts} recordings"
    change = f"removes {100.0 * gain:.2g} %" if gain > 0.0 else f"adds {100.0 * min(-gain, 10.0):.2g} %"
    more = " or more" if gain < -10.0 else ""
    return (
        f"each of {what} left out in turn and predicted from the others, it {change}{more} of the squared "
        f"error; {100.0 * LEAST_GAIN:g} % less is the least"
    )


def _fit_own(
    equations: BlockNormalEquations,
    slots: list[tuple[int, int]],
    theta: Array,
    own: Sequence[int],
    blocks: Index,
) -> None:
    """Set the `own` coefficients of the blocks' recording in place, beside the others as they are."""
    recording = int(equations.recording_of_block[blocks[0]])
    gram = equations.totals(blocks)[recording]
    free = [i for i in own if slots[i][1] == recording]
    given = [i for i, (_, of) in enumerate(slots) if of == -1 or (of == recording and i not in own)]
    free_places, given_places = ([slots[i][0] + 1 for i in some] for some in (free, given))
    sought = gram[free_places, 0] - gram[np.ix_(free_places, given_places)] @ theta[given]
    theta[free] = np.linalg.lstsq(gram[np.ix_(free_places, free_places)], sought, rcond=1e-10)[0]
