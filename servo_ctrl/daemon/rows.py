"""Where the row of a cycle goes: to the recording, and to monitoring or to the stroke being learned."""

from __future__ import annotations

import time
from array import array
from bisect import bisect_right
from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.telemetry.channels import AXIS_CHANNELS, MACHINE_CHANNELS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.telemetry.local_socket_rows import RowBuffer

    Array = NDArray[np.float64]

GAP_BRIDGED = 3
"""Samples: at 1 kHz and 0.1 m/s^2 a straight line is off by 0.2 um at most."""
CYCLE_EDGES = (
    *(0.25, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 1.0),
    *(1.01, 1.02, 1.05, 1.1, 1.2, 1.3, 1.5, 1.75, 2.0, 3.0, 5.0, 10.0, 20.0),
)
"""Of the histogram of cycle times, in periods."""
_PLACES = {channel.name: place for place, channel in enumerate(AXIS_CHANNELS)}
_CYCLE = [channel.name for channel in MACHINE_CHANNELS].index("cycle")


class Collector:
    """Takes some channels of one axis from the rows."""

    def __init__(self, config: MachineConfig, axis: str, channels: Sequence[str]) -> None:
        first = len(MACHINE_CHANNELS) + list(config.axes).index(axis) * len(AXIS_CHANNELS)
        self._cycles = array("d")
        self._columns = [(array("d"), first + _PLACES[channel]) for channel in channels]

    def take(self, values: list[float]) -> None:
        """One row of the recording."""
        self._cycles.append(values[_CYCLE])
        for column, place in self._columns:
            column.append(values[place])

    def columns(self) -> list[Array]:
        """The channels, (n,) each, of the cycles that were not missed; NaN where an input is missing."""
        return [np.array(column) for column, _ in self._columns]


class TravelCollector(Collector):
    """What the screw is learned from; see `learning.screw_travel.passes_of`."""

    def __init__(self, config: MachineConfig, axis: str) -> None:
        channels = ("position_command_m", "correction_m", "motor_position_m", "scale_position_m")
        super().__init__(config, axis, channels)


class StrokeCollector(Collector):
    """Position command and measured position: the scale's, or the motor's where there is none."""

    def __init__(self, config: MachineConfig, axis: str) -> None:
        measured = "motor_position_m" if config.axes[axis].scale is None else "scale_position_m"
        super().__init__(config, axis, ("position_command_m", measured))

    def samples(self) -> tuple[Array, Array]:
        """Position command and measured position, metres, (n,) each, one a cycle.

        Where a tick was missed the command went on in a straight line. A position that was not measured is
        NaN, unless it was missing so briefly that its neighbours tell it.
        """
        taken = np.array(self._cycles)
        command_m, measured_m = self.columns()
        cycles = np.arange(taken[0], taken[-1] + 1.0)
        position_m = np.full(len(cycles), np.nan)
        position_m[(taken - taken[0]).astype(np.int64)] = measured_m
        return np.interp(cycles, taken, command_m), bridged(position_m)


def bridged(position_m: Array) -> Array:
    """Gaps of up to `GAP_BRIDGED` NaN between numbers filled by straight lines, (n,)."""
    known = np.flatnonzero(np.isfinite(position_m))
    if not len(known):
        return position_m
    missing = np.flatnonzero(~np.isfinite(position_m))
    after = np.searchsorted(known, missing)
    inside = (after > 0) & (after < len(known))
    missing, after = missing[inside], after[inside]
    brief = missing[known[after] - known[after - 1] - 1 <= GAP_BRIDGED]
    filled = position_m.copy()
    filled[brief] = np.interp(brief, known, position_m[known])
    return filled


class RowTap:
    """Rows for the page and the time from one to the next; all that a tick pays for somebody looking on.

    `on_due` is called in a tick now and then, and in the next one where `again` was said.
    """

    def __init__(self, buffer: RowBuffer, period_s: float, due_s: float) -> None:
        self.edges_us = tuple(share * period_s * 1e6 for share in CYCLE_EDGES)
        self.counts = [0] * (len(self.edges_us) + 1)
        """Cycles by the time since the one before; see `config.local_status.Histogram`."""
        self.on_due: Callable[[], None] = _nobody
        self.period_s = period_s
        self._buffer = buffer
        self._edges_ns = [edge_us * 1e3 for edge_us in self.edges_us]
        self._keep = buffer.take
        self._interval_ns = round(due_s * 1e9)
        self._last_ns = self._due_ns = 0
        self._again = False

    def take(self, values: list[float]) -> None:
        """The row of this cycle."""
        self._keep(values)
        now_ns = time.perf_counter_ns()
        if self._last_ns:
            self.counts[bisect_right(self._edges_ns, now_ns - self._last_ns)] += 1
        self._last_ns = now_ns
        if now_ns >= self._due_ns:
            self._due_ns = now_ns + self._interval_ns
            self.on_due()
        elif self._again:
            self._again = False
            self.on_due()

    def again(self) -> None:
        """Something is left to be done behind the next tick."""
        self._again = True

    @property
    def end(self) -> int:
        """Rows so far."""
        return self._buffer.end

    def clear(self) -> None:
        """Count anew."""
        self.counts = [0] * len(self.counts)


def _nobody() -> None:
    pass


class Rows:
    """`observe` takes the rows of production, `stroke` those of a stroke, the others every row."""

    def __init__(self, observe: Callable[[list[float]], None]) -> None:
        self.record: Callable[[list[float]], None] | None = None
        self.look_on: Callable[[list[float]], None] | None = None
        self.stream: Callable[[list[float]], None] | None = None
        self.stroke: Collector | None = None
        self._observe = observe

    def take(self, values: list[float]) -> None:
        """The row of this cycle."""
        if self.record is not None:
            self.record(values)
        if self.look_on is not None:
            self.look_on(values)
        if self.stream is not None:
            self.stream(values)
        if self.stroke is None:
            self._observe(values)
        else:
            self.stroke.take(values)
