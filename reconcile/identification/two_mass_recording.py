"""A recording for the two-mass fit: its used samples, and the model's errors in units of sensor noise."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from reconcile.identification.two_mass_rollout import DrivingInputs, ModelResponse
from reconcile.regression.residual import Residual
from reconcile.sensing.channel import quantum

LONGEST_S = 16.0
"""Total length of the fitted recordings, s; more adds cost and little information. Chosen."""
BEGIN_S, END_S = 0.2, 0.02
"""Times at beginning and end that are not fitted, s: at first the observer settles and the table reaches a
flank; the motion after the end is unknown. Chosen."""
SHORT_BLOCK_S = 0.04
"""Length of a short block, s: an impact and its ringing."""


class TwoMassRecording(NamedTuple):
    """One recording; arrays (n,)."""

    driven: DrivingInputs
    scale_m: Array
    used: NDArray[np.bool_]
    """Samples that are fitted."""
    steps_m: tuple[float, float]
    """Quantisation steps of encoder and scale."""


def two_mass_recordings(residuals: Sequence[Residual]) -> list[TwoMassRecording]:
    """Return the first LONGEST_S of the recordings; held-out blocks drive the model but are not fitted."""
    recordings, remaining_s = [], LONGEST_S
    for residual in residuals:
        data, period_s = residual.data, residual.data.period_s
        count = min(len(data.time_s), math.floor(remaining_s / period_s))
        remaining_s -= count * period_s
        if data.scale_m is None or count * period_s < 2.0 * BEGIN_S:
            continue
        used = ~residual.held_out[:count]
        used[: math.ceil(BEGIN_S / period_s)] = False
        used[-math.ceil(END_S / period_s) :] = False
        inputs = DrivingInputs(period_s, data.force_n[:count], data.motion.position_m[:count])
        steps_m = _sensor_step(inputs.motor_m), _sensor_step(data.scale_m[:count])
        recordings.append(TwoMassRecording(inputs, data.scale_m[:count], used, steps_m))
    return recordings


def _sensor_step(values: Array) -> float:
    """Return the quantisation step of a sensor, or the step of equal variance if its noise is larger."""
    third = np.diff(values, 3)
    noise = 1.4826 * float(np.median(np.abs(third))) / math.sqrt(20.0)
    return max(quantum(values), noise * math.sqrt(12.0), 1e-12)


def short_block_errors(one: TwoMassRecording, run: ModelResponse) -> Array:
    """Return the errors of motor and scale in the used short blocks, in their noise (2, blocks, samples)."""
    length = max(round(SHORT_BLOCK_S / one.driven.period_s), 2)
    count = len(one.used) // length
    deviation_error_m = one.scale_m - one.driven.motor_m - run.deviation_m
    # the zero of the scale is arbitrary
    deviation_error_m = deviation_error_m - deviation_error_m[one.used].mean()
    both = np.stack((run.ahead_m, deviation_error_m))[:, : count * length].reshape(2, count, length)
    whole = one.used[: count * length].reshape(count, length).all(axis=1)
    noise_m = np.array(one.steps_m) / math.sqrt(12.0)
    errors: Array = both[:, whole] / noise_m[:, None, None]
    return errors
