"""Compute the achievable gain of a case: the residual when the concealed forces are subtracted by sample.

The sealed force holds all friction that is not viscous; mass, viscous friction, timing within a sample and
the scale's origins are refitted.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kernels.arrays import Array, rms
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.explain import Explanation
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.residual import Residual
from reconcile.regression.state_filter import StateFilter
from servo_ctrl.files.arrow import read_named

MIN_ACHIEVABLE = 0.05
"""Share of the held-out variance; below it there is nothing to gain, and no share is computed."""


def achieved(explanations: Sequence[Explanation], sealed: Path) -> dict[str, dict[str, Any]]:
    """Return by channel the held-out RMS refitted, after, achievable, and the achieved share of the gain."""
    return {e.channel.value: found for e in explanations if (found := _achieved_gain(e, sealed)) is not None}


def _achieved_gain(explanation: Explanation, sealed: Path) -> dict[str, Any] | None:
    targets, columns_by_recording, held_out_parts = [], [], []
    for residual in explanation.residuals:
        contribution = _sealed_contribution(residual, explanation.channel, sealed)
        if contribution is None:
            return None
        low_pass = StateFilter(residual.data.period_s, FILTER_HZ)
        targets.append((residual.measured - low_pass(contribution))[residual.used])
        columns_by_recording.append(_baseline_columns(residual, low_pass, explanation.channel)[residual.used])
        held_out_parts.append(residual.held_out[residual.used])
    y, held_out = np.concatenate(targets), np.concatenate(held_out_parts)
    columns = _stacked(columns_by_recording, explanation.channel)
    scale = np.sqrt(np.mean(columns**2, axis=0)) + 1e-300
    theta, *_ = np.linalg.lstsq(columns[~held_out] / scale, y[~held_out], rcond=None)
    floor = rms((y - columns / scale @ theta)[held_out])
    before, after = explanation.refitted.heldout, explanation.after.heldout
    possible = before**2 - floor**2
    share = (before**2 - after**2) / possible if possible > MIN_ACHIEVABLE * before**2 else None
    return {"before": before, "after": after, "floor": floor, "share": share}


def _sealed_contribution(residual: Residual, channel: ResidualChannel, sealed: Path) -> Array | None:
    """Return the sealed force or deviation (n,) of a recording; None if the recording was split."""
    name = residual.source.rsplit("/", 1)[-1]
    file = sealed / f"{name}.parquet"
    if not file.is_file():
        return None
    column = "known_force_n" if channel is ResidualChannel.FORCE else "known_deviation_m"
    values: Array = read_named([file], [column])[column]
    return values if len(values) == len(residual.used) else None


def _baseline_columns(residual: Residual, low_pass: StateFilter, channel: ResidualChannel) -> Array:
    m = residual.data.motion
    if channel is ResidualChannel.FORCE:
        late = np.gradient(residual.measured)
        return np.stack((low_pass(m.position_m, 2), low_pass(m.position_m, 1), late), axis=1)
    return low_pass(m.position_m, 1)[:, None]


def _stacked(columns_by_recording: Sequence[Array], channel: ResidualChannel) -> Array:
    """Stack the columns of all recordings; the origin of the scale is free in each."""
    columns = np.concatenate(columns_by_recording)
    if channel is ResidualChannel.FORCE:
        return columns
    own = np.zeros((len(columns), len(columns_by_recording)))
    first = 0
    for index, part in enumerate(columns_by_recording):
        own[first : first + len(part), index] = 1.0
        first += len(part)
    return np.concatenate((columns, own), axis=1)
