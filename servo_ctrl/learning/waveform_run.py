"""A learning run of the waveform compensation: strokes to be made, and what was learned of them.

Two strokes without compensation identify the friction. Then come strokes at each acceleration, from the
fastest to the slowest, each beginning with its neighbour's waveform; the best one counts. Two more check the
result.
"""

import math
from collections.abc import Generator
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.learning.performance import Indices, evaluation_m, reversals, window_samples
from servo_ctrl.learning.reversal_waveform import (
    SPAN_S,
    LoopModel,
    WaveformLearned,
    corrected,
    cut_out,
    identified,
    missing_force_n,
    samples_of,
    wave_table,
)
from servo_ctrl.learning.schedule import stroke_s
from servo_ctrl.learning.stroke_result import HALF_CYCLE_TOLERANCE, REVERSALS, half_cycle_s
from servo_ctrl.learning.types import NO_PULSE, LearningSettings, Outlook, Stroke

LEARNER = "waveform"
ACCELERATIONS, ITERATIONS, GAIN = 9, 6, 0.7
"""Reverse accelerations, most strokes at each, and learning gain; chosen: 58 strokes at most in all."""
LEAST_ITERATIONS, STALLED = 3, 0.95
"""An acceleration is over when a stroke after so many was not below this share of the best before; chosen."""
LEAST_ROWS = 2
"""From which on a waveform is carried on above what was learned."""
BEHIND_S = 1.2 * SPAN_S
"""How long a stroke is looked at after its last reversal."""


class WaveformSettings(NamedTuple):
    """How to learn one axis, and its own loop."""

    sines: LearningSettings
    """Of the strokes."""
    reach_m_s2: float
    """The largest reverse acceleration that is learned; not below that of the sines."""
    limit_m_s2: float
    """The largest one that the axis may be commanded."""
    loop: LoopModel


class WaveformStroke(NamedTuple):
    """A sine, and the force that is tried on it."""

    sine: Stroke
    friction: tuple[float, ...] | None
    """None: no compensation at all."""
    waves: Array
    """The table of the control law, (m, 1 + n)."""


class WaveformResult(NamedTuple):
    """A stroke as it was made, up to `BEHIND_S` after its last reversal."""

    commands: Array
    """(n, 3): position m, velocity m/s, acceleration m/s^2."""
    error_m: Array
    """(n,) against the feedback of the position loop."""
    reversals: Indices
    """(2,) samples."""


def waveform_result(
    position_command_m: Array,
    velocity_command_m_s: Array,
    error_m: Array,
    stroke: Stroke,
    settings: WaveformSettings,
) -> WaveformResult:
    """The samples (n,) that count of a stroke. Raises ValueError when a reversal or a sample is missing."""
    period_s = settings.loop.period_s
    window = window_samples(settings.sines.window_s, period_s)
    if not (np.isfinite(position_command_m).all() and np.isfinite(velocity_command_m_s).all()):
        raise ValueError("a position command is missing in the stroke")
    starts = reversals(position_command_m)[-REVERSALS:]
    if len(starts) < REVERSALS or starts[-1] + window > len(error_m):
        raise ValueError(f"the stroke ends before {REVERSALS} reversals are whole")
    apart_s, expected_s = float(starts[1] - starts[0]) * period_s, half_cycle_s(stroke, settings.sines)
    if abs(apart_s - expected_s) > HALF_CYCLE_TOLERANCE * expected_s + period_s:
        raise ValueError(f"the reversals are {apart_s:.3f} s apart, those of the sine {expected_s:.3f} s")
    end = int(starts[-1]) + round(BEHIND_S / period_s)
    if not np.isfinite(error_m[:end]).all():
        raise ValueError("a position sample is missing in the stroke")
    if starts[0] + samples_of(settings.loop) > len(error_m):
        raise ValueError("the stroke is too short for a waveform: learning.radius_mm is too small")
    acceleration_m_s2 = np.gradient(velocity_command_m_s, period_s)
    commands = np.column_stack([position_command_m, velocity_command_m_s, acceleration_m_s2])
    return WaveformResult(commands[:end], error_m[:end], starts)


def learn(settings: WaveformSettings) -> Generator[WaveformStroke, WaveformResult, WaveformLearned]:
    """Strokes in, waveforms out; strokes and machine time are filled in by `WaveformRun`."""
    loop, a = settings.loop, settings.sines.accelerations_m_s2
    nothing = wave_table((), ())
    checks = (float(np.sqrt(a[0] * a[-1])), a[-1])
    seen: list[tuple[Array, Array]] = []
    before_m: list[float] = []
    for a_m_s2 in checks:
        result = yield WaveformStroke(Stroke("identify", a_m_s2, NO_PULSE), None, nothing)
        seen.append((result.commands, result.error_m))
        before_m.append(score_m(result, settings))
    friction = identified(loop, seen)
    wave_n, found = np.zeros(samples_of(loop)), {}
    for a_m_s2 in np.geomspace(settings.reach_m_s2, a[0], ACCELERATIONS).tolist():
        wave_n = yield from _learn_wave(settings, friction, a_m_s2, wave_n)
        found[a_m_s2] = tuple(wave_n.round(4).tolist())
    found |= beyond_reach(found, settings)
    order = tuple(sorted(found))
    learned = WaveformLearned(LEARNER, friction, order, tuple(found[entry] for entry in order))
    after_m = []
    for a_m_s2 in checks:
        whole = wave_table(learned.accelerations_m_s2, learned.waves_n)
        result = yield WaveformStroke(Stroke("check", a_m_s2, NO_PULSE), friction, whole)
        after_m.append(score_m(result, settings))
    return learned._replace(before_m=float(np.mean(before_m)), after_m=float(np.mean(after_m)))


def _learn_wave(
    settings: WaveformSettings, friction: tuple[float, ...], a_m_s2: float, wave_n: Array
) -> Generator[WaveformStroke, WaveformResult, Array]:
    loop, best_m, best_n = settings.loop, np.inf, wave_n
    ahead = round(loop.ahead_s / loop.period_s)
    for iteration in range(ITERATIONS):
        table = wave_table((a_m_s2,), (tuple(wave_n.tolist()),))
        result = yield WaveformStroke(Stroke(LEARNER, a_m_s2, NO_PULSE), friction, table)
        found_m = score_m(result, settings)
        stalled = iteration >= LEAST_ITERATIONS and found_m > STALLED * best_m
        if found_m < best_m:  # never worse than before
            best_m, best_n = found_m, wave_n
        if stalled:
            break
        missing_n = missing_force_n(loop, result.error_m)
        around_n = cut_out(missing_n, result.reversals, _directions(result), len(wave_n), ahead)
        wave_n = corrected(wave_n, around_n - around_n[0], GAIN, loop)
    return best_n


def beyond_reach(
    found: dict[float, tuple[float, ...]], settings: WaveformSettings
) -> dict[float, tuple[float, ...]]:
    """The waveform at the limit of acceleration, if above all learned ones: over the same distance.

    Its size goes on as between the last two, at most with the speed at a distance, a^(1/2): so grow forces
    of friction that go with speed. It never shrinks.
    """
    order, loop, limit_m_s2 = sorted(found), settings.loop, settings.limit_m_s2
    if len(order) < LEAST_ROWS or not limit_m_s2 > order[-1]:
        return {}
    largest_n = [max(np.abs(found[entry]).max(), 1e-9) for entry in order[-2:]]
    exponent = math.log(largest_n[1] / largest_n[0]) / math.log(order[-1] / order[-2])
    ratio = limit_m_s2 / order[-1]
    led = np.arange(samples_of(loop)) - round(loop.ahead_s / loop.period_s) + loop.dead_samples
    own = np.where(led > 0, led * math.sqrt(ratio), led) - led[0]
    wave_n = np.interp(own, np.arange(len(led)), found[order[-1]], right=0.0)
    size = ratio ** min(max(exponent, 0.0), 0.5)
    return {limit_m_s2: tuple((size * wave_n).round(4).tolist())}


def score_m(result: WaveformResult, settings: WaveformSettings) -> float:
    """J over Tm, mean over the reversals."""
    window = window_samples(settings.sines.window_s, settings.loop.period_s)
    parts = [result.error_m[start : start + window] for start in result.reversals]
    return float(np.mean([evaluation_m(part) for part in parts]))


def _directions(result: WaveformResult) -> Array:
    starts = result.reversals
    return np.asarray(np.sign(result.commands[starts, 0] - result.commands[starts - 1, 0]))


class WaveformRun:
    """The strokes one by one: `stroke` is the next, None at the end; then `learned` is there."""

    def __init__(self, settings: WaveformSettings) -> None:
        self.learned: WaveformLearned | None = None
        self.course: list[tuple[str, float, float]] = []
        """Stage, acceleration m/s^2 and J m of each stroke."""
        self._settings = settings
        self._strokes = learn(settings)
        self.stroke: WaveformStroke | None = next(self._strokes)
        self._time_s = 0.0

    def take(self, result: WaveformResult) -> None:
        """Take the result of `stroke`, and go on to the next."""
        if self.stroke is None:
            raise ValueError("there is no stroke to be made")
        sine = self.stroke.sine
        self.course.append((sine.stage, sine.acceleration_m_s2, score_m(result, self._settings)))
        self._time_s += stroke_s(self._settings.sines, sine.acceleration_m_s2)
        try:
            self.stroke = self._strokes.send(result)
        except StopIteration as end:
            self.stroke = None
            self.learned = end.value._replace(strokes=len(self.course), machine_time_s=self._time_s)

    @property
    def outlook(self) -> Outlook:
        """How far it is."""
        a = self._settings.sines.accelerations_m_s2
        total, done = 4 + ACCELERATIONS * ITERATIONS, len(self.course)
        if self.stroke is None:
            return Outlook("done", done, done, 0.0)
        sine = self.stroke.sine
        at_this = [j for _, a_m_s2, j in self.course if a_m_s2 == sine.acceleration_m_s2]
        mean_s = np.mean(
            [
                stroke_s(self._settings.sines, x)
                for x in np.geomspace(a[0], self._settings.reach_m_s2, ACCELERATIONS)
            ]
        )
        return Outlook(
            sine.stage,
            done,
            total,
            float(mean_s) * (total - done),
            sine.acceleration_m_s2,
            min(at_this, default=np.nan),
        )
