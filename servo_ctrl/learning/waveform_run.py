"""Runs the learning of the waveform compensation: requests strokes, and updates the waveform from them.

Two strokes without compensation identify the friction. Strokes at each acceleration follow, from the largest
to the smallest, each starting with its neighbour's waveform; the waveform of least J is kept. Strokes with
rests follow likewise, if any are set. Two more strokes check the result.
"""

import math
from collections.abc import Generator
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.learning.performance import Indices, evaluation_m, window_samples
from servo_ctrl.learning.rest_force import TURNS, corrected_over_way, no_rest_force, rest_starts, rest_table
from servo_ctrl.learning.reversal_waveform import (
    SPAN_S,
    LoopModel,
    RestForce,
    WaveformLearned,
    corrected,
    identify_friction,
    mean_around_reversals,
    missing_force_n,
    samples_of,
    wave_table,
)
from servo_ctrl.learning.schedule import stroke_s
from servo_ctrl.learning.stroke_result import sine_reversals
from servo_ctrl.learning.types import NO_PULSE, LearningSettings, Outlook, Stroke

LEARNER = "waveform"
ACCELERATIONS, ITERATIONS, GAIN = 9, 6, 0.7
"""Number of reverse accelerations, most strokes at each, learning gain; chosen: at most 58 strokes in all."""
ITERATIONS_MIN, STALLED_RATIO = 3, 0.95
"""An acceleration ends when a stroke after this many has a J above this share of the best one; chosen."""
EXTRAPOLATION_ROWS_MIN = 2
"""Least number of waveforms for an extrapolation above the learned accelerations: two give an exponent."""
AFTER_S = 1.2 * SPAN_S
"""Time after its last reversal for which a stroke is evaluated, seconds; chosen."""
REST_ITERATIONS = 4
"""Most strokes for each rest; chosen: each begins with what the shorter one has learned."""


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
    rests = yield from _learn_rests(settings, friction, table)
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
            missing_n, result.reversals, _directions(result), len(wave_n), ahead
        )
        wave_n = corrected(wave_n, mean_missing_n - mean_missing_n[0], GAIN, loop)
    return best_n


def _learn_rests(
    settings: WaveformSettings, friction: tuple[float, ...], waves: Array
) -> Generator[WaveformStroke, WaveformResult, tuple[RestForce, ...]]:
    """Learn from the shortest rest to the longest, each starting with what was learned last."""
    learned: list[RestForce] = []
    for rest_s in settings.rests_s:
        first = learned[-1]._replace(rest_s=rest_s) if learned else no_rest_force(rest_s)
        learned.append((yield from _learn_rest(settings, friction, waves, first)))
    return tuple(learned)


def _learn_rest(
    settings: WaveformSettings, friction: tuple[float, ...], waves: Array, row: RestForce
) -> Generator[WaveformStroke, WaveformResult, RestForce]:
    a_m_s2 = math.sqrt(settings.sines.accelerations_m_s2[-1] * settings.largest_m_s2)
    best_m, best = np.inf, row
    for _ in range(REST_ITERATIONS):
        stroke = Stroke("rest", a_m_s2, NO_PULSE, row.rest_s)
        result = yield WaveformStroke(stroke, friction, waves, rest_table((row,)))
        j_m = score_m(result, settings)
        if j_m < best_m:
            best_m, best = j_m, row
        row = _corrected_row(row, result, settings.loop)
    return best


def _corrected_row(row: RestForce, result: WaveformResult, loop: LoopModel) -> RestForce:
    ahead, length = round(loop.ahead_s / loop.period_s), samples_of(loop)
    starts, directions = result.reversals, _directions(result)
    path_m = result.commands[starts[0] - 1 - ahead + loop.dead_samples :, 0][:length]
    way_m = np.abs(path_m - result.commands[starts[0] - 1, 0])
    missing_n = missing_force_n(loop, result.error_m)

    def next_n(force_n: tuple[float, ...], *, turned: bool) -> tuple[float, ...]:
        here = np.array(TURNS) == turned
        mean_n = mean_around_reversals(missing_n, starts[here], directions[here], length, ahead)
        return corrected_over_way(force_n, mean_n - mean_n[0], way_m, loop, GAIN)

    return row._replace(
        onward_n=next_n(row.onward_n, turned=False), turned_n=next_n(row.turned_n, turned=True)
    )


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


def score_m(result: WaveformResult, settings: WaveformSettings) -> float:
    """J over Tm, mean over the reversals, m."""
    window = window_samples(settings.sines.window_s, settings.loop.period_s)
    parts = [result.error_m[start : start + window] for start in result.reversals]
    return float(np.mean([evaluation_m(part) for part in parts]))


def _directions(result: WaveformResult) -> Array:
    starts = result.reversals
    return np.asarray(np.sign(result.commands[starts, 0] - result.commands[starts - 1, 0]))


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
        self._time_s += stroke_s(self._settings.sines, sine.acceleration_m_s2) + len(TURNS) * sine.rest_s
        try:
            self.stroke = self._strokes.send(result)
        except StopIteration as end:
            self.stroke = None
            self.learned = end.value._replace(strokes=len(self.course), machine_time_s=self._time_s)

    @property
    def outlook(self) -> Outlook:
        """Progress of the run."""
        a, rests_s = self._settings.sines.accelerations_m_s2, self._settings.rests_s
        total = 4 + ACCELERATIONS * ITERATIONS + REST_ITERATIONS * len(rests_s)
        done = len(self.course)
        if self.stroke is None:
            return Outlook("done", done, done, 0.0)
        sine = self.stroke.sine
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
            remaining_s=float(mean_s) * (total - done) + self._resting_s(sine.rest_s),
            acceleration_m_s2=sine.acceleration_m_s2,
            best_m=min(scores_m, default=np.nan),
        )

    def _resting_s(self, since_s: float) -> float:
        """Time of the rests that are still to be learned, from this one on, seconds."""
        return sum(
            REST_ITERATIONS * len(TURNS) * rest_s for rest_s in self._settings.rests_s if rest_s >= since_s
        )
