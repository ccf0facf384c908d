"""Residual of a recording with a model file as written: no coefficient is fitted.

The residual is that of the diagnosis, behind the same filter and in the same samples. Only the zero of a
scale against its motor, which changes with each power-up, is fitted for the recording.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.transport_delay import ENTRY as TRANSPORT_DELAY
from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters
from reconcile.identification.model_force import with_identified_force
from reconcile.recording.recording import AxisRecording
from reconcile.regression.model_presliding import regressed_terms
from reconcile.regression.regression_data import regression_data, samples_in_use, target_and_baseline
from reconcile.regression.regression_problem import regression_problem


class ModelResidual(NamedTuple):
    """Residual of a model on one recording in one channel; arrays (n,), N or m."""

    measured: Array
    """The filtered channel itself."""
    residual: Array
    used: NDArray[np.bool_]
    """Samples that count."""


def written_residual(
    recording: AxisRecording, axis: NominalAxis, channel: ResidualChannel, timing_s: float = 0.0
) -> ModelResidual:
    """Residual of the model on a recording; `timing_s`: delay between force and position samples."""
    data = regression_data(recording, axis)
    terms = regressed_terms(axis, [data], channel)
    if timing_s and channel is ResidualChannel.FORCE:
        terms = [*terms, ModelTerm(TRANSPORT_DELAY.name, (timing_s,), (1.0,))]
    baseline = [0.0, 0.0]
    if channel is ResidualChannel.FORCE:
        baseline = list(baseline_parameters(axis).values())
        with_measured_force = regression_problem([data], channel, only=True, model_terms=terms)
        slots = with_measured_force.equations.slots([])
        # terms that depend on the force use that of the model, which the measured one would falsify
        data = with_identified_force(with_measured_force, 0, slots, np.array(baseline))
    problem = regression_problem([data], channel, only=True, model_terms=terms)
    target, columns = problem.target_and_columns(0)
    residual = target - columns @ np.array(baseline)
    used = samples_in_use(data, channel)
    if channel is ResidualChannel.POSITION_DEVIATION:
        residual = residual - residual[used].mean()
    return ModelResidual(target_and_baseline(data, channel)[0], residual, used)
