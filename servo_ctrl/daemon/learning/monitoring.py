"""Monitors reversals in the cycle: detects them in the recorded rows and evaluates each.

Between reversals a cycle costs a few comparisons an axis. A reversal is evaluated after its monitoring time
Tm, unless the axis's next reversal, a missing input, a missed cycle, power off or the end of the program
cuts the monitoring off.
"""

import math
from collections.abc import Callable

from kernels.arrays import Array
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.compensation.trapezoidal_pulse import FrictionCompensationSettings
from servo_ctrl.learning.monitor import SETTLED, DueRule, Window, across_m, evaluated, next_due_state
from servo_ctrl.learning.performance import REST_M, window_samples
from servo_ctrl.learning.types import ReversalReport
from servo_ctrl.recording.channels import places_of
from servo_ctrl.units import UM


class _MonitoredAxis:
    """Columns of one axis in the row, and its state between two rows."""

    __slots__ = ("command_at", "direction", "moves", "position_at", "velocity_at", "window")

    def __init__(self, name: str, places: dict[str, int], *, has_scale: bool) -> None:
        self.command_at = places[f"{name}.position_command_m"]
        self.velocity_at = places[f"{name}.velocity_command_m_s"]
        self.position_at = places[f"{name}.{'scale' if has_scale else 'motor'}_position_m"]
        self.direction = 0
        """Sign of the last motion; 0 = unknown."""
        self.moves = False
        self.window: Window | None = None


class ReversalMonitor:
    """Computes the indicators of every reversal while axes follow set points, and whether learning is due.

    After Tm it updates `due` and `last` and calls `on_reversal` with the index of the axis, the report and
    the error trace (n,), metres, error = command - actual; then `on_due` if `due` has changed.
    """

    def __init__(
        self,
        config: MachineConfig,
        on_reversal: Callable[[int, ReversalReport, Array], None],
        on_due: Callable[[int, bool], None],
    ) -> None:
        count = len(config.axes)
        monitoring = config.monitoring
        self.last: list[ReversalReport | None] = [None] * count
        self.counts = [0] * count
        """By axis: reversals evaluated."""
        self.cut_off = [0] * count
        """By axis: reversals not evaluated because their monitoring was cut off."""
        self._on_reversal = on_reversal
        self._on_due = on_due
        self._rule = DueRule(
            monitoring.required_um * UM, monitoring.settled_below, monitoring.due_after_reversals
        )
        self._states = [SETTLED] * count
        self._learns = [
            axis.section(FrictionCompensationSettings) is not None for axis in config.axes.values()
        ]
        """By axis: whether it has a pulse to learn, so that learning can be due."""
        self._period_s = config.period_s
        self._samples = window_samples(monitoring.window_s, config.period_s)
        places = places_of(config.axes)
        self._cycle, self._segment = places["cycle"], places["segment"]
        self._axes = [
            _MonitoredAxis(name, places, has_scale=axis.scale is not None)
            for name, axis in config.axes.items()
        ]
        self._plane = self._axes[:2] if count > 1 else []
        """The first two axes, in whose plane the contour error is computed."""
        self._step_m = (0.0, 0.0)
        """The last commanded step in that plane, while a window is open."""
        self._open = 0
        """Number of open windows."""
        self._no_row = [math.nan] * len(places)
        self._previous = self._no_row
        self._next_cycle = math.nan

    @property
    def required_m(self) -> float:
        """J_required, metres. A new value applies from the next reversal on."""
        return self._rule.required_m

    @required_m.setter
    def required_m(self, value_m: float) -> None:
        self._rule = self._rule._replace(required_m=value_m)
        self._states = [state._replace(in_a_row=0) for state in self._states]

    @property
    def due(self) -> list[bool]:
        """Whether learning is due, by axis."""
        return [state.due for state in self._states]

    def observe(self, values: list[float]) -> None:
        """Take one recorded row; it is kept until the next one."""
        previous = self._previous
        if values[self._cycle] != self._next_cycle:
            previous = self._no_row
        self._previous = values
        self._next_cycle = values[self._cycle] + 1
        for axis in self._axes:
            step_m = values[axis.command_at] - previous[axis.command_at]
            if -REST_M < step_m < REST_M:
                axis.moves = False
            elif step_m > 0.0:
                axis.moves = True
                if axis.direction < 0:
                    self._begin(axis, 1, values, previous)
                axis.direction = 1
            elif step_m < 0.0:
                axis.moves = True
                if axis.direction > 0:
                    self._begin(axis, -1, values, previous)
                axis.direction = -1
            else:  # NaN: the axis follows no set points, or this is the first row after a gap
                axis.moves = False
                axis.direction = 0
                self._cut_off(axis)
        if self._open:
            self._sample(values, previous)

    def _begin(
        self, axis: _MonitoredAxis, direction: int, values: list[float], previous: list[float]
    ) -> None:
        """Open the window of a reversal, which cuts off a window still open."""
        self._cut_off(axis)
        change_m_s = values[axis.velocity_at] - previous[axis.velocity_at]
        axis.window = Window(int(values[self._cycle]), direction, abs(change_m_s) / self._period_s)
        self._open += 1

    def _cut_off(self, axis: _MonitoredAxis) -> None:
        if axis.window is not None:
            axis.window = None
            self._open -= 1
            self.cut_off[self._axes.index(axis)] += 1

    def _sample(self, values: list[float], previous: list[float]) -> None:
        """Add one sample to the open windows."""
        contour_m, in_plane = 0.0, False
        if self._plane:
            x, y = self._plane
            in_plane = x.window is not None or y.window is not None
        if in_plane:
            if x.moves or y.moves:  # else the last direction still applies
                self._step_m = (
                    values[x.command_at] - previous[x.command_at],
                    values[y.command_at] - previous[y.command_at],
                )
            contour_m = across_m(self._step_m, (_error_m(x, values), _error_m(y, values)))
        for index, axis in enumerate(self._axes):
            window = axis.window
            if window is None:
                continue
            if values[self._segment] < 0:
                self._cut_off(axis)
                continue
            other_moves = index < 2 and in_plane and self._plane[1 - index].moves
            if window.add(_error_m(axis, values), contour_m, other_moves=other_moves) == self._samples:
                self._evaluate(index, axis, window)

    def _evaluate(self, index: int, axis: _MonitoredAxis, window: Window) -> None:
        evaluation = evaluated(window)
        if evaluation is None:
            self._cut_off(axis)
            return
        axis.window = None
        self._open -= 1
        report, trace_m = evaluation
        self.last[index] = report
        self.counts[index] += 1
        before = self._states[index]
        if self._learns[index]:
            self._states[index] = next_due_state(self._rule, before, report.error_mean_m)
        self._on_reversal(index, report, trace_m)
        if self._states[index].due != before.due:
            self._on_due(index, self._states[index].due)


def _error_m(axis: _MonitoredAxis, values: list[float]) -> float:
    return values[axis.command_at] - values[axis.position_at]
