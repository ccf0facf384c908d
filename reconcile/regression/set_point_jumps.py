"""Force of a drive that closes the position loop, without the teeth that its set points cut into it.

In CSP the velocity feedforward sees the set points as steps, one a cycle. With the acceleration a of the set
points the force jumps by kv ff a T after each SYNC, and falls by as much until the next, at which the current
is sampled. A sample lacks half of that tooth, which is the force of a mass: the fitted one lacks kv ff T / 2.
Gains of the drive and recorded set points give the tooth; no motion tells it from a mass.
"""

import math

import numpy as np

from kernels.arrays import Array
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.recording.recording import AxisRecording

POSITION_MODE = "csp"
"""Mode of a drive that closes its position loop on the recorded set points."""
SET_POINT_CYCLES = 1
"""Cycles from the sample with which a set point is recorded until it acts."""


def force_without_teeth_n(recording: AxisRecording, axis: NominalAxis) -> Array:
    """Return the force (n,) with what its samples lack of the mean over a cycle of the drive.

    As recorded where the drive was led otherwise, or reference or gains are not known, or samples are means.
    """
    if recording.mode != POSITION_MODE or recording.samples_in_a_mean > 1 or recording.reference_m is None:
        return recording.force_n
    jump_m = np.diff(recording.reference_m, 2, prepend=np.full(2, recording.reference_m[0]))
    jump_m = np.roll(jump_m, SET_POINT_CYCLES)
    jump_m[:SET_POINT_CYCLES] = 0.0
    share = missing_share(recording.period_s, axis.drive_loops.current_lag_s)
    return recording.force_n + share * axis.drive_loops.feedforward_n_s_m / recording.period_s * jump_m


def missing_share(cycle_s: float, lag_s: float) -> float:
    """Return the share of a tooth's height that a sample at its end lacks, behind a first-order lag.

    One half without a lag. The steady answer of a first-order lag to a sawtooth of period `cycle_s`.
    """
    if lag_s <= 0.0:
        return 0.5
    ratio = cycle_s / lag_s
    return 0.5 / math.tanh(0.5 * ratio) - 1.0 / ratio
