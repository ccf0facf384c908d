"""What a model leaves of a recording: the material of every picture and of all that is located."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene
    from reconcile.ledger import Candidate
    from reconcile.scenes import Difference

    Array = NDArray[np.float64]
    Index = NDArray[np.int64]


class Rest(NamedTuple):
    """One recording in one sense; SI (N or m), all (n,)."""

    source: str
    scene: Scene
    measured: Array
    """The difference itself: force behind the filter, or scale less motor."""
    before: Array
    """With the model's nominal values."""
    refitted: Array
    """With its values fitted anew, no effect added."""
    after: Array
    """With all the effects found."""
    used: NDArray[np.bool_]
    """Samples that count: not the filter's beginning; in the force, not a standstill."""
    held_out: NDArray[np.bool_]


def rests(
    found: Difference,
    sources: Sequence[str],
    models: Sequence[tuple[Sequence[Candidate], Array]],
    held: Index,
) -> list[Rest]:
    """By recording. `models`: before, refitted and after, each its candidates and normalised coefficients."""
    whole = []
    for index, (source, scene) in enumerate(zip(sources, found.scenes, strict=True)):
        y, columns = found.sides(index)
        left = []
        for chosen, theta in models:
            slots = found.ledger.slots(chosen)
            weights = found.ledger.real(slots, theta)
            prediction = np.zeros(len(y))
            for (column, own), weight in zip(slots, weights, strict=True):
                if own in (-1, index):
                    prediction += weight * columns[:, column]
            left.append(y - prediction)
        held_out = np.isin(found.block_of[index], held)
        before, refitted, after = left
        whole.append(Rest(source, scene, y, before, refitted, after, found.used[index], held_out))
    return whole


def rms(of: Sequence[Rest], what: Literal["refitted", "after"]) -> float:
    """Of the samples that count, of all the recordings together; SI."""
    left: list[Array] = [getattr(rest, what)[rest.used] ** 2 for rest in of]
    return float(np.sqrt(np.mean(np.concatenate(left))))
