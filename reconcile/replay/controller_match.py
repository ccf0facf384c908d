"""Checks that a controller of a model file reproduces the recorded force.

Its inputs are the recorded positions; no model of the axis is involved. A force that it does not reproduce
comes from another control law or was injected beside it: the replay errors then do not measure the models
alone.
"""

import math

import numpy as np
from scipy.signal import lfilter

from reconcile.recording.recording import AxisRecording
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.state_filter import StateFilter
from reconcile.replay.controller import Controller

HIGH_PASS_S = 0.5
"""Time constant of the high pass on both forces: it removes the unknown initial integral and its drift."""


def controller_mismatch(recording: AxisRecording, controller: Controller) -> float | None:
    """Return the RMS of the recorded force that the controller does not reproduce, over that of the force.

    None where it cannot be determined: no reference, sampled more coarsely than the controller, force at its
    limit with an integral, or too short.
    """
    period_s, window = controller.sample_time_s, controller.velocity_samples
    if recording.reference_m is None or recording.period_s > 1.01 * period_s:
        return None
    low_pass = StateFilter(period_s, FILTER_HZ)
    count = math.floor(recording.time_s[-1] / period_s + 1e-6) + 1
    if count < 2 * (window + low_pass.settled):
        return None
    command_n = recording.force_n if recording.force_command_n is None else recording.force_command_n
    instants_s = np.arange(count) * period_s
    motor_m, reference_m, force_n = (
        np.interp(instants_s, recording.time_s, values)
        for values in (recording.motor_m, recording.reference_m, command_n)
    )
    velocity_m_s = (motor_m[window:] - motor_m[:-window]) / (window * period_s)
    error_m_s = controller.position_gain_1_s * (reference_m - motor_m)[window:] - velocity_m_s
    error_m_s += controller.velocity_feedforward * np.gradient(reference_m, period_s)[window:]
    proportional_n, force_n = controller.velocity_gain_n_s_m * error_m_s, force_n[window:]
    if controller.velocity_integral_n_m == 0.0:
        proportional_n = np.clip(proportional_n, -controller.force_limit_n, controller.force_limit_n)
    elif np.abs(force_n).max() >= 0.99 * controller.force_limit_n:
        return None
    high_pass = [1.0, -math.exp(-period_s / HIGH_PASS_S)]
    # an integral behind the high pass is a low pass of its input
    integral_n = lfilter([controller.velocity_integral_n_m * period_s], high_pass, error_m_s)
    expected_n = lfilter([1.0, -1.0], high_pass, proportional_n - proportional_n[0]) + integral_n
    recorded_n = lfilter([1.0, -1.0], high_pass, force_n - force_n[0])
    missed_n, seen_n = (low_pass(one)[low_pass.settled :] for one in (recorded_n - expected_n, recorded_n))
    return float(np.linalg.norm(missed_n) / max(float(np.linalg.norm(seen_n)), 1e-300))
