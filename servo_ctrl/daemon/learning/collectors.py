"""Collects the samples of a learning stroke or travel from the recorded rows."""

from array import array
from collections.abc import Sequence

import numpy as np

from kernels.arrays import Array
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.recording.channels import places_of

GAP_SAMPLES_MAX = 3
"""Bounds an interpolated gap, samples: at 1 kHz and 0.1 m/s^2 a straight line deviates by at most 0.2 um."""


class Collector:
    """Collects chosen channels of one axis from the recorded rows."""

    def __init__(self, config: MachineConfig, axis: str, channels: Sequence[str]) -> None:
        places = places_of(config.axes)
        self._cycle = places["cycle"]
        self._cycles = array("d")
        self._columns = [(array("d"), places[f"{axis}.{channel}"]) for channel in channels]

    def take(self, values: list[float]) -> None:
        """Take one recorded row."""
        self._cycles.append(values[self._cycle])
        for column, place in self._columns:
            column.append(values[place])

    def columns(self) -> list[Array]:
        """Return the channels, (n,) each, for all cycles that ran; NaN where an input is missing."""
        return [np.array(column) for column, _ in self._columns]


def travel_collector(config: MachineConfig, axis: str) -> Collector:
    """Make the collector of a screw-learning travel; see `learning.screw_travel.passes_of`."""
    channels = ("position_command_m", "correction_m", "motor_position_m", "scale_position_m")
    return Collector(config, axis, channels)


class StrokeCollector(Collector):
    """Collects position command and measured position, of the scale or, without one, of the motor."""

    def __init__(self, config: MachineConfig, axis: str) -> None:
        measured = "motor_position_m" if config.axes[axis].scale is None else "scale_position_m"
        super().__init__(config, axis, ("position_command_m", measured))

    def samples(self) -> tuple[Array, Array]:
        """Return position command and measured position, metres, (n,) each, one value a cycle.

        The command is interpolated linearly over missed ticks. A missing position is NaN, unless its gap is
        short enough for interpolation between its neighbours.
        """
        ran = np.array(self._cycles)
        command_m, measured_m = self.columns()
        cycles = np.arange(ran[0], ran[-1] + 1.0)
        position_m = np.full(len(cycles), np.nan)
        position_m[(ran - ran[0]).astype(np.int64)] = measured_m
        return np.interp(cycles, ran, command_m), bridged(position_m)


class WaveformCollector(Collector):
    """Collects commands, and the error against the feedback of the position loop."""

    def __init__(self, config: MachineConfig, axis: str) -> None:
        channels = ("position_command_m", "velocity_command_m_s", "position_error_m")
        super().__init__(config, axis, channels)

    def samples(self) -> tuple[Array, Array, Array]:
        """Return position command, velocity command and error, (n,) each, like `StrokeCollector`."""
        ran = np.array(self._cycles)
        position_m, velocity_m_s, measured_error_m = self.columns()
        cycles = np.arange(ran[0], ran[-1] + 1.0)
        error_m = np.full(len(cycles), np.nan)
        error_m[(ran - ran[0]).astype(np.int64)] = measured_error_m
        return (
            np.interp(cycles, ran, position_m),
            np.interp(cycles, ran, velocity_m_s),
            bridged(error_m),
        )


def bridged(position_m: Array) -> Array:
    """Interpolate linearly over gaps of up to `GAP_SAMPLES_MAX` NaN between numbers, (n,)."""
    known = np.flatnonzero(np.isfinite(position_m))
    if not len(known):
        return position_m
    missing = np.flatnonzero(~np.isfinite(position_m))
    after = np.searchsorted(known, missing)
    inside = (after > 0) & (after < len(known))
    missing, after = missing[inside], after[inside]
    short_gaps = missing[known[after] - known[after - 1] - 1 <= GAP_SAMPLES_MAX]
    filled = position_m.copy()
    filled[short_gaps] = np.interp(short_gaps, known, position_m[known])
    return filled
