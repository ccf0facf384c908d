"""Whether a controller is that of a recording: fed with the recorded positions, it gives the recorded force.

No model of the axis is in this. What it does not give is another law, or a force beside it; either is not the
models' fault, and a replay shows it all the same.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import lfilter

from reconcile.scenes import FILTER_HZ
from reconcile.state_filter import StateFilter

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reconcile.recording import AxisRecording
    from reconcile.replay_controller import Controller

    Array = NDArray[np.float64]

LEAK_S = 0.5
"""Both forces are seen behind a high pass: how the integral began, and the drift of a sum, are not known."""


def unmatched(recording: AxisRecording, controller: Controller) -> float | None:
    """Share of the recorded force, RMS, that the controller does not give.

    None where it cannot be said: sampled more coarsely than the controller, no reference, an integral at its
    limit, or too short.
    """
    period_s, window = controller.period_s, controller.velocity_samples
    if recording.reference_m is None or recording.period_s > 1.01 * period_s:
        return None
    low_pass = StateFilter(period_s, FILTER_HZ)
    count = math.floor(recording.time_s[-1] / period_s + 1e-6) + 1
    if count < 2 * (window + low_pass.settled):
        return None
    given_n = recording.force_n if recording.force_command_n is None else recording.force_command_n
    instants_s = np.arange(count) * period_s
    motor_m, reference_m, force_n = (
        np.interp(instants_s, recording.time_s, values)
        for values in (recording.motor_m, recording.reference_m, given_n)
    )
    velocity_m_s = (motor_m[window:] - motor_m[:-window]) / (window * period_s)
    error_m_s = controller.position_gain_1_s * (reference_m - motor_m)[window:] - velocity_m_s
    error_m_s += controller.velocity_feedforward * np.gradient(reference_m, period_s)[window:]
    direct_n, force_n = controller.velocity_gain_n_s_m * error_m_s, force_n[window:]
    if controller.velocity_integral_n_m == 0.0:
        direct_n = np.clip(direct_n, -controller.force_limit_n, controller.force_limit_n)
    elif np.abs(force_n).max() >= 0.99 * controller.force_limit_n:
        return None
    leak = [1.0, -math.exp(-period_s / LEAK_S)]
    summed_n = lfilter([controller.velocity_integral_n_m * period_s], leak, error_m_s)
    expected_n = lfilter([1.0, -1.0], leak, direct_n - direct_n[0]) + summed_n
    recorded_n = lfilter([1.0, -1.0], leak, force_n - force_n[0])
    missed_n, seen_n = (low_pass(one)[low_pass.settled :] for one in (recorded_n - expected_n, recorded_n))
    return float(np.linalg.norm(missed_n) / max(float(np.linalg.norm(seen_n)), 1e-300))
