"""Which effects predict recordings that they were not fitted on; the others are withdrawn.

Cross-validation by short blocks asks whether a term predicts the same motion a moment later. A term that
follows the misfit of one recording passes it. Here each recording is left out in turn, or each third of an
only one: an effect must make the prediction of what was left out better.
Source: Roberts et al. (2017), blocking in cross-validation by the structure of the data.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, Index
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.normal_equations import BlockNormalEquations, CandidateTerm, effect_names

PARTS_OF_ONE = 3
"""Stretches that an only recording is cut into."""
STRETCH_BLOCKS = 4
"""Blocks of a stretch of a left-out recording, by which its own coefficients are fitted and judged."""
LEAST_GAIN = 0.01
"""Least share of the left-out squares that an effect removes: that of a term in `SelectionRules`."""


class Withdrawn(NamedTuple):
    """An effect that fitted, and is not named."""

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


def left_out_squares(
    equations: BlockNormalEquations, chosen: Sequence[CandidateTerm], parts: Sequence[Index]
) -> Array:
    """Squared residuals of each part, predicted from the others, (parts,).

    What a recording has of its own (an origin, a phase, a level) is fitted on every other stretch of it, and
    predicts those in between. Its own curves without a name are fitted on all of it: no name is at stake.
    """
    named = [c for c in chosen if not c.effect.startswith(PREFIX)]
    slots = equations.slots([*named, *(c for c in chosen if c not in named)])
    first_unnamed = len(equations.slots(named))
    found = np.zeros(len(parts))
    for place, part in enumerate(parts):
        others = np.concatenate([other for number, other in enumerate(parts) if number != place])
        elsewhere = set(equations.recording_of_block[others].tolist())
        theta = equations.solve(slots, equations.totals(others))
        own = [i for i, (_, recording) in enumerate(slots) if recording not in {-1, *elsewhere}]
        judged = [i for i in own if i < first_unnamed]
        if len(judged) < len(own):
            _fit_own(equations, slots, theta, own, part)
        halves = _interleaved(part) if judged else [part]
        for number, half in enumerate(halves):
            if judged:
                _fit_own(equations, slots, theta, judged, halves[1 - number])
            found[place] += equations.squares(slots, theta, half).sum()
    return found


def predictive_terms(
    equations: BlockNormalEquations, chosen: Sequence[CandidateTerm], blocks: Index
) -> tuple[list[CandidateTerm], list[Withdrawn]]:
    """The terms without the effects that do not predict what is left out, the worst withdrawn first.

    Terms without a name must predict it too, and are dropped without a word: what they leave is said as such.
    What each recording has of its own without a name is no prediction.
    """
    kept, withdrawn = list(chosen), []
    parts = left_out_parts(equations, blocks)
    alone = len(np.unique(equations.recording_of_block[blocks])) == 1
    while len(parts) > 1:
        whole = float(left_out_squares(equations, kept, parts).sum())
        gains = {}
        for effect in effect_names(kept):
            others = [c for c in kept if c.effect != effect]
            if effect.startswith(PREFIX) and any(c.per_recording for c in kept if c.effect == effect):
                continue
            without = float(left_out_squares(equations, others, parts).sum())
            gains[effect] = 1.0 - whole / max(without, 1e-300)
        worst = min(gains, key=lambda effect: gains[effect], default=None)
        if worst is None or gains[worst] >= LEAST_GAIN:
            break
        kept = [c for c in kept if c.effect != worst]
        if not worst.startswith(PREFIX):
            withdrawn.append(Withdrawn(worst, _why(gains[worst], len(parts), alone=alone)))
    return kept, withdrawn


def _interleaved(part: Index) -> list[Index]:
    """Every other stretch of a recording, and those in between."""
    odd = np.arange(len(part)) // STRETCH_BLOCKS % 2 == 1
    return [part[~odd], part[odd]] if odd.any() else np.array_split(part, 2)


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
