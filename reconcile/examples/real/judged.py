"""The data on which models of a measured axis are compared: the filtered force of the samples in motion.

A model file is used as written: its residual is `before` of a diagnosis with that model.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, rms
from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.formats.nominal_axis import baseline_parameters
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import AxisRecording, load_recordings
from reconcile.regression.model_presliding import regressed_terms
from reconcile.regression.regression_data import (
    low_pass_of,
    regression_data,
    samples_in_use,
    stride,
    target_and_baseline,
)
from reconcile.regression.regression_problem import regression_problem


class Judged(NamedTuple):
    """One axis in one recording; arrays (n,) or (n, k), in the units of the files, after the state filter."""

    recording: AxisRecording
    data: RegressionData
    force_n: Array
    rigid: Array
    """Acceleration, velocity and direction, (n, 3)."""
    position_m: Array
    used: NDArray[np.bool_]

    def error(self, predicted_n: Array) -> float:
        """Return the RMS error of a prediction (n,) in the used samples, N."""
        return rms((self.force_n - predicted_n)[self.used])

    def kept(self) -> NDArray[np.int64]:
        """Return the indices of the samples to fit on, at four times the bandwidth of the filter."""
        return np.flatnonzero(self.used)[:: stride(self.data.period_s)]


def judged(paths: Sequence[Path], nominal: Path) -> dict[str, list[list[Judged]]]:
    """Return the recordings by axis, then by file; a file may lack an axis, or have several pieces."""
    model = load_model(nominal)
    by_file = [load_recordings([path], model.axes) for path in paths]
    return {
        name: [[_judged(one, nominal) for one in file if one.axis == name] for file in by_file]
        for name in model.axes
    }


def _judged(recording: AxisRecording, nominal: Path) -> Judged:
    data = regression_data(recording, load_model(nominal).axes[recording.axis])
    force_n, rigid = target_and_baseline(data, ResidualChannel.FORCE)
    position_m = low_pass_of(data)(data.motion.position_m)
    used = samples_in_use(data, ResidualChannel.FORCE)
    return Judged(
        recording=recording, data=data, force_n=force_n, rigid=rigid, position_m=position_m, used=used
    )


def model_residual_n(model: Path, one: Judged) -> Array:
    """Return the residual (n,), N, of a model file on a recording, without a fit. Raises ReconcileError."""
    axis = load_model(model).axes[one.recording.axis]
    data = regression_data(one.recording, axis)
    terms = regressed_terms(axis, [data], ResidualChannel.FORCE)
    problem = regression_problem([data], ResidualChannel.FORCE, only=True, model_terms=terms)
    target, columns = problem.target_and_columns(0)
    base = baseline_parameters(axis)
    residual_n: Array = target - columns @ np.array([base[name] for name in problem.baseline_names])
    return residual_n


def error_of(model: Path, one: Judged) -> float:
    """Return the RMS of that residual in the used samples, N. Raises ReconcileError."""
    return rms(model_residual_n(model, one)[one.used])
