"""Runs the learning of the waveform compensation: requests strokes, and updates the waveform from them.

Two strokes without compensation identify the friction. Strokes at each acceleration follow, from the largest
to the smallest, each starting with its neighbour's waveform; the waveform of least J is kept. Strokes with
rests follow likewise, if any are set. Two more strokes check the result.
"""

import math
from collections.abc import Generator

import numpy as np

from kernels.arrays import Array
from servo_ctrl.learning.rest_force import REST, learn_rests, rest_table, rest_time_s
from servo_ctrl.learning.rest_force import strokes_of as rest_strokes_of
from servo_ctrl.learning.reversal_waveform import (
    WaveformLearned,
    corrected,
    identify_friction,
    mean_around_reversals,
    missing_force_n,
    samples_of,
    wave_table,
)
from servo_ctrl.learning.schedule import stroke_s
from servo_ctrl.learning.types import NO_PULSE, Outlook, Stroke
from servo_ctrl.learning.waveform_stroke import (
    GAIN,
    LEARNER,
    WaveformResult,
    WaveformSettings,
    WaveformStroke,
    directions_of,
    score_m,
)

ACCELERATIONS, ITERATIONS = 9, 6
"""Number of reverse accelerations, most strokes at each; chosen: at most 58 strokes in all, without rests."""
ITERATIONS_MIN, STALLED_RATIO = 3, 0.95
"""An acceleration ends when a stroke after this many has a J above this share of the best one; chosen."""
EXTRAPOLATION_ROWS_MIN = 2
"""Least number of waveforms for an extrapolation above the learned accelerations: two give an exponent."""


def learn(settings: WaveformSettings) -> Generator[WaveformStroke, WaveformResult, WaveformLearned]:
    """Yield strokes, return waveforms; `WaveformRun` fills in strokes and machine time."""
    loop, a = settings.loop, settings.sines.accelerations_m_s2
    no_waves = wave_table((), ())
    checks = (float(np.sqrt(a[0] * a[-1])), a[-1])
    free_strokes: list[tuple[Array, Array]] = []
    before_m: list[float] = []
    for a_m_s2 in checks:
        result = yield WaveformStroke(Stroke("identify", a_m_s2, NO_PULSE), None, no_waves)
        free_strokes.append((result.commands, result.error_m))
        before_m.append(score_m(result, settings))
    friction = identify_friction(loop, free_strokes)
    wave_n, waves = np.zeros(samples_of(loop)), {}
    for a_m_s2 in np.geomspace(settings.largest_m_s2, a[0], ACCELERATIONS).tolist():
        wave_n = yield from _learn_wave(settings, friction, a_m_s2, wave_n)
        waves[a_m_s2] = tuple(wave_n.round(4).tolist())
    waves |= extrapolated_waveform(waves, settings)
    order = tuple(sorted(waves))
    table = wave_table(order, tuple(waves[entry] for entry in order))
    rests = yield from learn_rests(settings, friction, table)
    learned = WaveformLearned(LEARNER, friction, order, tuple(waves[entry] for entry in order), rests=rests)
    after_m = []
    for a_m_s2 in checks:
        result = yield WaveformStroke(Stroke("check", a_m_s2, NO_PULSE), friction, table, rest_table(rests))
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
        j_m = score_m(result, settings)
        stalled = iteration >= ITERATIONS_MIN and j_m > STALLED_RATIO * best_m
        if j_m < best_m:
            best_m, best_n = j_m, wave_n
        if stalled:
            break
        missing_n = missing_force_n(loop, result.error_m)
        mean_missing_n = mean_around_reversals(
            missing_n, result.reversals, directions_of(result), len(wave_n), ahead
        )
        wave_n = corrected(wave_n, mean_missing_n - mean_missing_n[0], GAIN, loop)
    return best_n


def extrapolated_waveform(
    waves: dict[float, tuple[float, ...]], settings: WaveformSettings
) -> dict[float, tuple[float, ...]]:
    """Extrapolate the waveform to the acceleration limit, if that is above all learned accelerations.

    Equal distances correspond. Its size grows as between the last two accelerations, at most like a^(1/2),
    the speed at equal distance, because viscous friction grows so. It never shrinks.
    """
    order, loop, limit_m_s2 = sorted(waves), settings.loop, settings.limit_m_s2
    if len(order) < EXTRAPOLATION_ROWS_MIN or not limit_m_s2 > order[-1]:
        return {}
    largest_n = [max(np.abs(waves[entry]).max(), 1e-9) for entry in order[-2:]]
    exponent = math.log(largest_n[1] / largest_n[0]) / math.log(order[-1] / order[-2])
    ratio = limit_m_s2 / order[-1]
    position = np.arange(samples_of(loop)) - round(loop.ahead_s / loop.period_s) + loop.dead_samples
    source_index = np.where(position > 0, position * math.sqrt(ratio), position) - position[0]
    wave_n = np.interp(source_index, np.arange(len(position)), waves[order[-1]], right=0.0)
    amplitude_ratio = ratio ** min(max(exponent, 0.0), 0.5)
    return {limit_m_s2: tuple((amplitude_ratio * wave_n).round(4).tolist())}


class WaveformRun:
    """Learning of one axis: make `stroke`, give `take` its result, until `stroke` is None; see `learned`."""

    def __init__(self, settings: WaveformSettings) -> None:
        self.learned: WaveformLearned | None = None
        self.course: list[tuple[str, float, float]] = []
        """Stage, acceleration m/s^2 and J m of each stroke."""
        self._settings = settings
        self._strokes = learn(settings)
        self.stroke: WaveformStroke | None = next(self._strokes)
        self._time_s = 0.0

    def take(self, result: WaveformResult) -> None:
        """Take the result of `stroke`, and determine the next."""
        if self.stroke is None:
            raise ValueError("there is no stroke to be made")
        sine = self.stroke.sine
        self.course.append((sine.stage, sine.acceleration_m_s2, score_m(result, self._settings)))
        self._time_s += stroke_s(self._settings.sines, sine.acceleration_m_s2) + rest_time_s(sine)
        try:
            self.stroke = self._strokes.send(result)
        except StopIteration as end:
            self.stroke = None
            self.learned = end.value._replace(strokes=len(self.course), machine_time_s=self._time_s)

    @property
    def outlook(self) -> Outlook:
        """Progress of the run."""
        a, rests = self._settings.sines.accelerations_m_s2, rest_strokes_of(self._settings)
        total, done = 4 + ACCELERATIONS * ITERATIONS + len(rests), len(self.course)
        if self.stroke is None:
            return Outlook("done", done, done, 0.0)
        sine, made = self.stroke.sine, sum(stage == REST for stage, *_ in self.course)
        scores_m = [j for _, a_m_s2, j in self.course if a_m_s2 == sine.acceleration_m_s2]
        mean_s = np.mean(
            [
                stroke_s(self._settings.sines, x)
                for x in np.geomspace(a[0], self._settings.largest_m_s2, ACCELERATIONS)
            ]
        )
        return Outlook(
            stage=sine.stage,
            strokes_done=done,
            strokes_total=total,
            remaining_s=float(mean_s) * (total - done) + sum(map(rest_time_s, rests[made:])),
            acceleration_m_s2=sine.acceleration_m_s2,
            best_m=min(scores_m, default=np.nan),
        )
