"""Extracts the errors after the reversals of a stroke from its samples."""

import numpy as np

from kernels.arrays import Array
from servo_ctrl.learning.performance import Indices, reversals
from servo_ctrl.learning.types import LearningSettings, Stroke, StrokeResult

TRACE_S = 0.8
"""Bounds the error trace after a reversal, seconds: friction errors decay long before; chosen."""
HALF_CYCLE_SHARE = 0.4
"""Bounds the error trace as a share of the half cycle, to end well before the next reversal; chosen."""
REVERSALS = 2
"""Reversals of one sine cycle."""
HALF_CYCLE_TOLERANCE = 0.02
"""Relative tolerance of the time between the reversals of a sine; chosen."""
ERROR_RESOLUTION_M = 1e-9
"""Errors are rounded to nanometres: finer than any scale, and a journal reproduces the same numbers."""


def trace_samples(stroke: Stroke, settings: LearningSettings, period_s: float) -> int:
    """Number of samples kept after a reversal."""
    share_s = HALF_CYCLE_SHARE * half_cycle_s(stroke, settings)
    return max(int(min(TRACE_S, share_s) / period_s), 1)


def half_cycle_s(stroke: Stroke, settings: LearningSettings) -> float:
    """Time from one reversal of the sine to the next, seconds."""
    return float(np.pi * np.sqrt(settings.radius_m / stroke.acceleration_m_s2))


def stroke_result(
    position_command_m: Array, position_m: Array, stroke: Stroke, settings: LearningSettings, period_s: float
) -> StrokeResult:
    """Take the errors after the reversals of one stroke; its samples (n,) enclose the sine.

    Raises ValueError when a reversal is incomplete or a sample is missing.
    """
    if not np.isfinite(position_command_m).all():
        raise ValueError("a position command is missing in the stroke")
    samples = trace_samples(stroke, settings, period_s)
    starts = sine_reversals(position_command_m, samples, stroke, settings, period_s)
    rows = starts[:, np.newaxis] + np.arange(samples)
    direction = np.sign(position_command_m[starts] - position_command_m[starts - 1])
    error_m = (position_command_m[rows] - position_m[rows]) * direction[:, np.newaxis]
    if not np.isfinite(error_m).all():
        raise ValueError("a position sample is missing in the stroke")
    return StrokeResult(np.round(error_m / ERROR_RESOLUTION_M) * ERROR_RESOLUTION_M + 0.0, period_s)


def sine_reversals(
    position_command_m: Array, samples: int, stroke: Stroke, settings: LearningSettings, period_s: float
) -> Indices:
    """Indices (2,) of the first samples after the reversals of the sine in the commands (n,) of a stroke.

    They are the last two: a move to the centre before the sine may have others. Raises ValueError when they
    are not a half cycle apart, or fewer than `samples` follow.
    """
    starts = reversals(position_command_m)[-REVERSALS:]
    if len(starts) < REVERSALS or starts[-1] + samples > len(position_command_m):
        raise ValueError(f"the stroke ends before {REVERSALS} reversals are whole")
    apart_s, expected_s = float(starts[1] - starts[0]) * period_s, half_cycle_s(stroke, settings)
    if abs(apart_s - expected_s) > HALF_CYCLE_TOLERANCE * expected_s + period_s:
        raise ValueError(f"the reversals are {apart_s:.3f} s apart, those of the sine {expected_s:.3f} s")
    return starts


def first_samples(result: StrokeResult, span_s: float) -> Array:
    """Return the errors (reversals, n) within `span_s` after the reversals, as far as the result has them."""
    return result.error_m[:, : max(round(span_s / result.period_s), 1)]


def evaluation_m(result: StrokeResult, span_s: float) -> float:
    """Mean |e| over `span_s` after the reversals: J over the monitoring time, Jd over t2 - t1; metres."""
    return float(np.mean(np.abs(first_samples(result, span_s))))


def window_s(settings: LearningSettings, duration_s: float) -> float:
    """Tm of a stroke, seconds: a multiple of the pulse duration, at least the Tm of production."""
    return max(settings.window_s, settings.window_durations * duration_s)


def interval_s(result: StrokeResult) -> float:
    """Interval t2 - t1 from the reversal to the peak of the error, mean over the reversals, seconds."""
    return float(np.mean(np.argmax(np.abs(result.error_m), axis=1))) * result.period_s
