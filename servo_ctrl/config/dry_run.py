"""Simulates a program without a machine: extents, largest speeds and accelerations, slow blocks."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from servo_ctrl.config.kernel_params import motion_limits
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.motion.move import Dwell
from servo_ctrl.motion.path.path_move import PathMove, plan_path
from servo_ctrl.motion.profile import Motion, Profile
from servo_ctrl.motion.program import SEGMENT_SAMPLES, Step, plan_step, sample_count

PLOT_SAMPLES_MAX = 20_000
"""Bounds the number of samples in a plot; chosen."""
_FEED_REACHED_SHARE = 0.995
"""Share of the feed above which the feed counts as reached; chosen."""


class BlockSpeeds(NamedTuple):
    """Speeds along the path in one block of a part program at feed (G1, G2, G3)."""

    line: int
    feed_m_s: float
    top_m_s: float
    """Highest and mean speed of its samples."""
    mean_m_s: float


class DryRun(NamedTuple):
    """Figures of a program that starts at home; arrays are (axes,) in machine order, SI units."""

    duration_s: float
    length_m: float
    """Length of the commanded path."""
    lowest_m: Array
    highest_m: Array
    speed_m_s: Array
    """Largest value of each axis, like the next two fields."""
    acceleration_m_s2: Array
    jerk_m_s3: Array
    """Difference of accelerations between samples, divided by the period."""
    path_speed_m_s: float
    """Largest speed along the path."""
    reached: float
    """Share of the path at feed on which the feed is reached; NaN without a path at feed."""
    lines: tuple[BlockSpeeds, ...]
    """Blocks at feed, except blocks too short for a sample."""
    plot_m: Array
    """Positions (n, axes) thinned for a plot; the next field is the speed along the path there (n,)."""
    plot_m_s: Array
    plot_rapid: NDArray[np.bool_]
    """Whether each position belongs to a rapid move (G0), (n,)."""

    @property
    def slowest(self) -> BlockSpeeds | None:
        """Block with the least mean speed relative to its feed; None without blocks at feed."""
        return min(self.lines, key=lambda entry: entry.mean_m_s / entry.feed_m_s, default=None)

    @property
    def slow_lines(self) -> list[BlockSpeeds]:
        """Blocks that never reach their feed, slowest first."""
        slow = [entry for entry in self.lines if entry.top_m_s < _FEED_REACHED_SHARE * entry.feed_m_s]
        return sorted(slow, key=lambda entry: entry.top_m_s / entry.feed_m_s)


def dry_run(steps: Sequence[Step], machine: MachineConfig) -> DryRun:
    """Simulate a checked program from home."""
    limits, period_s = motion_limits(machine), machine.period_s
    start_m = np.zeros(len(machine.axes))
    figures = _Accumulator(start_m, period_s)
    lines: list[BlockSpeeds] = []
    for step in steps:
        if isinstance(step, PathMove):
            plan = plan_path(step, start_m, limits, period_s)
            profile = plan.profile
            feed_m_s = np.array([element.feed_m_s for element in step.elements])
            top_m_s, sum_m_s, count = np.zeros((3, len(feed_m_s)))
            for time_s, motion in _sampled(profile, period_s):
                element_index = plan.element_at(time_s)
                path_m_s = figures.add(motion, feed_m_s[element_index])
                np.maximum.at(top_m_s, element_index, path_m_s)
                np.add.at(sum_m_s, element_index, path_m_s)
                np.add.at(count, element_index, 1.0)
            lines += [
                BlockSpeeds(element.line, element.feed_m_s, float(top), float(total / samples))
                for element, top, total, samples in zip(step.elements, top_m_s, sum_m_s, count, strict=True)
                if samples > 0.0 and np.isfinite(element.feed_m_s)
            ]
        else:
            profile = plan_step(step, start_m, limits, period_s)
            for _, motion in () if isinstance(step, Dwell) else _sampled(profile, period_s):
                figures.add(motion, np.zeros(len(motion.position_m)))
        figures.cycles += sample_count(profile.duration_s, period_s)
        start_m = profile.end_m
    return figures.result(lines)


def _sampled(profile: Profile, period_s: float) -> Iterator[tuple[Array, Motion]]:
    """Yield times (n,) and motion of the commanded samples, in chunks."""
    count = sample_count(profile.duration_s, period_s)
    for first in range(0, count, SEGMENT_SAMPLES):
        stop = min(first + SEGMENT_SAMPLES, count)
        time_s = np.minimum(np.arange(first + 1, stop + 1) * period_s, profile.duration_s)
        yield time_s, profile.at(time_s)


class _Accumulator:
    """Accumulates extents and extremes of samples."""

    def __init__(self, start_m: Array, period_s: float) -> None:
        self.cycles = 0
        self._period_s = period_s
        self._lowest_m, self._highest_m = start_m, start_m
        self._largest = np.zeros((3, len(start_m)))
        """Largest speed, acceleration and jerk of each axis, (3, axes)."""
        self._previous_m_s2 = np.zeros((1, len(start_m)))
        self._path_speed_m_s = self._length_m = self._fed_m = self._reached_m = 0.0
        self._plot_stride = 1
        self._plot_rows = np.concatenate((start_m, [0.0, 1.0]))[np.newaxis]
        """Rows of position, speed, and 1 for a rapid move."""

    def add(self, motion: Motion, feed_m_s: Array) -> Array:
        """Add samples and their feed (0 without one); return their speed along the path."""
        path_m_s = np.linalg.norm(motion.velocity_m_s, axis=1)
        self._lowest_m = np.minimum(self._lowest_m, motion.position_m.min(axis=0))
        self._highest_m = np.maximum(self._highest_m, motion.position_m.max(axis=0))
        change_m_s2 = np.diff(np.concatenate((self._previous_m_s2, motion.acceleration_m_s2)), axis=0)
        values = motion.velocity_m_s, motion.acceleration_m_s2, change_m_s2 / self._period_s
        self._largest = np.maximum(self._largest, [np.abs(value).max(axis=0) for value in values])
        self._previous_m_s2 = motion.acceleration_m_s2[-1:]
        self._path_speed_m_s = max(self._path_speed_m_s, float(path_m_s.max()))
        self._length_m += float(path_m_s.sum()) * self._period_s
        fed = (feed_m_s > 0.0) & np.isfinite(feed_m_s)
        self._fed_m += float(path_m_s[fed].sum()) * self._period_s
        reached = fed & (path_m_s >= _FEED_REACHED_SHARE * feed_m_s)
        self._reached_m += float(path_m_s[reached].sum()) * self._period_s
        rows = np.column_stack((motion.position_m, path_m_s, np.isinf(feed_m_s)))[:: self._plot_stride]
        self._plot_rows = np.concatenate((self._plot_rows, rows))
        while len(self._plot_rows) > PLOT_SAMPLES_MAX:
            self._plot_rows, self._plot_stride = self._plot_rows[::2], 2 * self._plot_stride
        return np.asarray(path_m_s)

    def result(self, lines: list[BlockSpeeds]) -> DryRun:
        """Return the figures of all samples and of the blocks."""
        speed, acceleration, jerk = self._largest
        return DryRun(
            duration_s=self.cycles * self._period_s,
            length_m=self._length_m,
            lowest_m=self._lowest_m,
            highest_m=self._highest_m,
            speed_m_s=speed,
            acceleration_m_s2=acceleration,
            jerk_m_s3=jerk,
            path_speed_m_s=self._path_speed_m_s,
            lines=tuple(lines),
            reached=self._reached_m / self._fed_m if self._fed_m > 0.0 else math.nan,
            plot_m=self._plot_rows[:, :-2],
            plot_m_s=self._plot_rows[:, -2],
            plot_rapid=self._plot_rows[:, -1] == 1.0,
        )
