"""Strokes that learn waveforms: their settings, what acts on one, and what it has come to."""

from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.learning.performance import Indices, evaluation_m, window_samples
from servo_ctrl.learning.rest_strokes import rest_starts
from servo_ctrl.learning.reversal_waveform import SPAN_S, LoopModel, samples_of
from servo_ctrl.learning.stroke_result import sine_reversals
from servo_ctrl.learning.types import LearningSettings, Stroke

LEARNER = "waveform"
GAIN = 0.7
"""Gain of the learning law from stroke to stroke; chosen."""
AFTER_S = 1.2 * SPAN_S
"""Time after its last reversal for which a stroke is evaluated, seconds; chosen."""


class WaveformSettings(NamedTuple):
    """Learning settings of one axis, and the model of its loop."""

    sines: LearningSettings
    """Settings of the sine strokes."""
    largest_m_s2: float
    """Largest reverse acceleration that is learned; at least that of the sines."""
    limit_m_s2: float
    """Largest acceleration that the axis may be commanded."""
    loop: LoopModel
    rests_s: tuple[float, ...] = ()
    """Rests whose force is learned, rising."""


class WaveformStroke(NamedTuple):
    """A sine, and the force to be tried on it."""

    sine: Stroke
    friction: tuple[float, ...] | None
    """None: no compensation at all."""
    waves: Array
    """The table of the control law, (m, 1 + n)."""
    rests: Array | None = None
    """The table of the rests, (r, 1 + 2 N)."""


class WaveformResult(NamedTuple):
    """A completed stroke, up to `AFTER_S` after its last reversal."""

    commands: Array
    """(n, 3): position m, velocity m/s, acceleration m/s^2."""
    error_m: Array
    """(n,): command minus the feedback of the position loop."""
    reversals: Indices
    """(k,): indices of the first samples of the new directions, or behind the rests."""


def waveform_result(
    position_command_m: Array,
    velocity_command_m_s: Array,
    error_m: Array,
    stroke: Stroke,
    settings: WaveformSettings,
) -> WaveformResult:
    """Cut the evaluated samples out of those (n,) of a stroke.

    Raises ValueError when a reversal or a sample is missing.
    """
    period_s = settings.loop.period_s
    window = window_samples(settings.sines.window_s, period_s)
    if not (np.isfinite(position_command_m).all() and np.isfinite(velocity_command_m_s).all()):
        raise ValueError("a position command is missing in the stroke")
    if stroke.rest_s:
        starts = rest_starts(position_command_m, stroke.rest_s, period_s)
    else:
        starts = sine_reversals(position_command_m, window, stroke, settings.sines, period_s)
    end = int(starts[-1]) + round(AFTER_S / period_s)
    if not np.isfinite(error_m[:end]).all():
        raise ValueError("a position sample is missing in the stroke")
    if starts[0] + samples_of(settings.loop) > len(error_m):
        raise ValueError("the stroke is too short for a waveform: learning.radius_mm is too small")
    acceleration_m_s2 = np.gradient(velocity_command_m_s, period_s)
    commands = np.column_stack([position_command_m, velocity_command_m_s, acceleration_m_s2])
    return WaveformResult(commands[:end], error_m[:end], starts)


def score_m(result: WaveformResult, settings: WaveformSettings) -> float:
    """J over Tm, mean over the reversals, m."""
    window = window_samples(settings.sines.window_s, settings.loop.period_s)
    parts = [result.error_m[start : start + window] for start in result.reversals]
    return float(np.mean([evaluation_m(part) for part in parts]))


def directions_of(result: WaveformResult) -> Array:
    """Directions (k,) of the motions that begin at its `reversals`, +1 or -1."""
    starts = result.reversals
    return np.asarray(np.sign(result.commands[starts, 0] - result.commands[starts - 1, 0]))
