"""Leave-one-recording-out test of the selected terms: effects that do not predict it are withdrawn.

Cross-validation by short blocks asks whether a term predicts the same motion a moment later. A term that
follows the misfit of one recording passes it. Here each recording is left out in turn, or each third of a
single one: an effect must reduce the squared error of its prediction. Whether the model file that results
predicts a recording is tested later (`proof`).
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
from reconcile.selection.selection_rules import SelectionRules

PARTS_OF_SINGLE_RECORDING = 3
"""Parts of a single recording, and of each recording where whole ones would be an extrapolation."""
STRETCH_BLOCKS = 4
"""Blocks of a stretch of a left-out recording, by which its own coefficients are fitted and judged."""
MOST_LEVERAGE_RATIO = 20.0
"""Mean leverage of a block over that of the blocks that predict it, above which its prediction is an
extrapolation, as from 24 K of warming to 45 K. Similar motions stay below 10. Chosen."""
LEAST_PREDICTABLE_SHARE = 0.2
"""Share of blocks that are not an extrapolation, below which an effect is judged on thirds of each recording;
chosen."""
LEAST_GAIN = SelectionRules().least_gain
"""Least share of the left-out squares that an effect removes."""


class WithdrawnEffect(NamedTuple):
    """An effect that was selected, but does not predict what was left out, or is physically impossible."""

    effect: str
    why: str
    """In words, for the report."""


class PredictiveTerms(NamedTuple):
    """The result of the test."""

    kept: list[CandidateTerm]
    withdrawn: list[WithdrawnEffect]
    """The worst first."""


def held_out_parts(equations: BlockNormalEquations, blocks: Index) -> list[Index]:
    """The blocks of each recording; of a single one, those of each third."""
    recordings = equations.recording_of_block[blocks]
    present = np.unique(recordings)
    if len(present) == 1:
        return [part for part in np.array_split(blocks, PARTS_OF_SINGLE_RECORDING) if len(part)]
    return [blocks[recordings == recording] for recording in present]


def held_out_squares_by_block(
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
    squares: list[Array] = []
    for number, part in enumerate(parts):
        others = _other_blocks(parts, number)
        recordings = set(equations.recording_of_block[others].tolist())
        theta = equations.solve(slots, equations.totals(others))
        own = [i for i, (_, recording) in enumerate(slots) if recording not in {-1, *recordings}]
        own_named = [i for i in own if i < first_unnamed]
        if len(own_named) < len(own):
            _fit_own_coefficients(equations, slots, theta, own, part)
        halves = _interleaved_halves(part) if own_named else [part]
        of_part = np.zeros(len(part))
        for predicted, half in enumerate(halves):
            if len(halves) > 1:
                _fit_own_coefficients(equations, slots, theta, own_named, halves[1 - predicted])
            of_part[np.isin(part, half)] = equations.squares(slots, theta, half)
        squares.append(of_part)
    return np.concatenate(squares)


def predictive_terms(
    equations: BlockNormalEquations, chosen: Sequence[CandidateTerm], blocks: Index
) -> PredictiveTerms:
    """The terms without the effects that do not predict what is left out, the worst withdrawn first.

    Unnamed terms must predict it too. They are dropped without a reason for the report, which states the
    unexplained residual as such. Unnamed terms that each recording has of its own are exempt.
    """
    kept, withdrawn = list(chosen), []
    parts = held_out_parts(equations, blocks)
    is_single = len(np.unique(equations.recording_of_block[blocks])) == 1
    while len(parts) > 1:
        gains = _held_out_gains(equations, kept, parts)
        worst = min(gains, key=lambda effect: gains[effect], default=None)
        if worst is None or gains[worst] >= LEAST_GAIN:
            break
        kept = [c for c in kept if c.effect != worst]
        if not worst.startswith(PREFIX):
            withdrawn.append(WithdrawnEffect(worst, _reason(gains[worst], len(parts), is_single=is_single)))
    return PredictiveTerms(kept, withdrawn)


def _held_out_gains(
    equations: BlockNormalEquations, chosen: Sequence[CandidateTerm], parts: Sequence[Index]
) -> dict[str, float]:
    """Share of the left-out squares that each effect removes, where the test applies to it."""
    squares_of_all = held_out_squares_by_block(equations, chosen, parts)
    gains = {}
    for effect in effect_names(chosen):
        if effect.startswith(PREFIX) and any(c.per_recording for c in chosen if c.effect == effect):
            continue
        others = [c for c in chosen if c.effect != effect]
        predictable = _predictable_blocks(equations, chosen, effect, parts)
        if predictable.mean() >= LEAST_PREDICTABLE_SHARE:
            squares = squares_of_all
            squares_without = held_out_squares_by_block(equations, others, parts)
        else:
            thirds = _thirds_of_each(parts)
            squares = held_out_squares_by_block(equations, chosen, thirds)
            squares_without = held_out_squares_by_block(equations, others, thirds)
            predictable = np.ones(len(squares_without), dtype=np.bool_)
        left = float(squares_without[predictable].sum())
        gains[effect] = 1.0 - float(squares[predictable].sum()) / max(left, 1e-300)
    return gains


def _predictable_blocks(
    equations: BlockNormalEquations, chosen: Sequence[CandidateTerm], effect: str, parts: Sequence[Index]
) -> NDArray[np.bool_]:
    """Blocks (blocks,) in which an effect is excited no more than in the other parts, by their leverage.

    All of them, where each recording has coefficients of its own.
    """
    terms = [c for c in chosen if c.effect == effect]
    blocks = np.concatenate(parts)
    if any(c.per_recording for c in terms):
        return np.ones(len(blocks), dtype=np.bool_)
    columns = [1 + column for c in terms for column in c.columns]
    other_columns = [1 + column for column in range(len(equations.baseline_is_free))]
    other_columns += [1 + column for c in chosen if c.effect != effect for column in c.columns]
    first = len(other_columns)
    places = np.array([*other_columns, *columns])
    is_predictable: list[NDArray[np.bool_]] = []
    for number, part in enumerate(parts):
        others = _other_blocks(parts, number)
        gram = equations.gram[np.ix_(others, places, places)].sum(axis=0)
        # the part of the effect's columns that is orthogonal to the other columns
        orthogonal = np.concatenate(
            (-np.linalg.pinv(gram[:first, :first]) @ gram[:first, first:], np.eye(len(columns)))
        )
        inverse = np.linalg.pinv(orthogonal.T @ gram @ orthogonal)
        products = equations.gram[np.ix_(part, places, places)]
        leverage = products.reshape(len(part), -1) @ (orthogonal @ inverse @ orthogonal.T).ravel()
        mean_leverage = len(columns) / max(float(equations.samples[others].sum()), 1.0)
        is_predictable.append(leverage <= MOST_LEVERAGE_RATIO * mean_leverage * equations.samples[part])
    return np.concatenate(is_predictable)


def _other_blocks(parts: Sequence[Index], left_out: int) -> Index:
    return np.concatenate([part for number, part in enumerate(parts) if number != left_out])


def _thirds_of_each(parts: Sequence[Index]) -> list[Index]:
    """The first third of all parts, the second and the last."""
    thirds = [np.array_split(part, PARTS_OF_SINGLE_RECORDING) for part in parts]
    return [third for third in map(np.concatenate, zip(*thirds, strict=True)) if len(third)]


def _interleaved_halves(part: Index) -> list[Index]:
    """Every other stretch of a recording, and those in between; a single block stays alone."""
    odd = np.arange(len(part)) // STRETCH_BLOCKS % 2 == 1
    return [part[~odd], part[odd]] if odd.any() else np.array_split(part, min(2, len(part)))


def _reason(gain: float, parts: int, *, is_single: bool) -> str:
    what = f"{parts} stretches" if is_single else f"{parts} recordings"
    change = f"removes {100.0 * gain:.2g} %" if gain > 0.0 else f"adds {100.0 * min(-gain, 10.0):.2g} %"
    more = " or more" if gain < -10.0 else ""
    return (
        f"each of {what} left out in turn and predicted from the others, it {change}{more} of the squared "
        f"error; {100.0 * LEAST_GAIN:g} % less is the least"
    )


def _fit_own_coefficients(
    equations: BlockNormalEquations,
    slots: list[tuple[int, int]],
    theta: Array,
    own: Sequence[int],
    blocks: Index,
) -> None:
    """Set in `theta` the `own` coefficients of the blocks' recording by least squares beside the others.

    `own`: places in `slots` and `theta`; `blocks` are of one recording.
    """
    recording = int(equations.recording_of_block[blocks[0]])
    gram = equations.totals(blocks)[recording]
    free = [i for i in own if slots[i][1] == recording]
    fixed = [i for i, (_, of) in enumerate(slots) if of == -1 or (of == recording and i not in own)]
    free_columns, fixed_columns = ([slots[i][0] + 1 for i in places] for places in (free, fixed))
    right_side = gram[free_columns, 0] - gram[np.ix_(free_columns, fixed_columns)] @ theta[fixed]
    theta[free] = np.linalg.lstsq(gram[np.ix_(free_columns, free_columns)], right_side, rcond=1e-10)[0]
