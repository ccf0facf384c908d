"""The gain that concealed effects allow: what is left when their own forces are taken away, sample by sample.

The truth's force holds all of the friction but what is viscous; mass, viscous friction, timing within a
sample, and the scale's origins are fitted anew.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow.parquet as pq

from reconcile.catalogue.kinds import Sense
from reconcile.scenes import FILTER_HZ
from reconcile.state_filter import StateFilter

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from reconcile.explain import Explanation
    from reconcile.rests import Rest

    Array = NDArray[np.float64]

LEAST_GAIN = 0.05
"""Share of the held-out variance below which there was nothing to gain."""


def achieved(explanations: Sequence[Explanation], sealed: Path) -> dict[str, dict[str, Any]]:
    """By sense: held-out RMS before (values refitted), after, and with all that is known gone; the share."""
    return {e.sense.value: found for e in explanations if (found := _of(e, sealed)) is not None}


def _of(explanation: Explanation, sealed: Path) -> dict[str, Any] | None:
    left, base, held = [], [], []
    for rest in explanation.rests:
        known = _known(rest, explanation.sense, sealed)
        if known is None:
            return None
        low_pass = StateFilter(rest.scene.period_s, FILTER_HZ)
        left.append((rest.measured - low_pass(known))[rest.used])
        base.append(_base(rest, low_pass, explanation.sense)[rest.used])
        held.append(rest.held_out[rest.used])
    y, columns, unseen = np.concatenate(left), _joined(base, explanation.sense), np.concatenate(held)
    scale = np.sqrt(np.mean(columns**2, axis=0)) + 1e-300
    theta, *_ = np.linalg.lstsq(columns[~unseen] / scale, y[~unseen], rcond=None)
    floor = float(np.sqrt(np.mean((y - columns / scale @ theta)[unseen] ** 2)))
    before, after = explanation.refitted.heldout, explanation.after.heldout
    possible = before**2 - floor**2
    share = (before**2 - after**2) / possible if possible > LEAST_GAIN * before**2 else None
    return {"before": before, "after": after, "floor": floor, "share": share}


def _known(rest: Rest, sense: Sense, sealed: Path) -> Array | None:
    """The column of the sealed file of this recording; None where it was split."""
    name = rest.source.rsplit("/", 1)[-1]
    file = sealed / f"{name}.parquet"
    if not file.is_file():
        return None
    column = "known_force_n" if sense is Sense.FORCE else "known_deviation_m"
    values: Array = pq.read_table(file, columns=[column]).column(0).to_numpy()
    return values if len(values) == len(rest.used) else None


def _base(rest: Rest, low_pass: StateFilter, sense: Sense) -> Array:
    m = rest.scene.motion
    if sense is Sense.FORCE:
        late = np.gradient(rest.measured)
        return np.stack((low_pass(m.position_m, 2), low_pass(m.position_m, 1), late), axis=1)
    return low_pass(m.position_m, 1)[:, None]


def _joined(base: Sequence[Array], sense: Sense) -> Array:
    """One below the other; the origin of the scale is free in each recording."""
    columns = np.concatenate(base)
    if sense is Sense.FORCE:
        return columns
    own = np.zeros((len(columns), len(base)))
    first = 0
    for index, part in enumerate(base):
        own[first : first + len(part), index] = 1.0
        first += len(part)
    return np.concatenate((columns, own), axis=1)
