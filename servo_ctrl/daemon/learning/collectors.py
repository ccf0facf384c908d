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

    def samples(self) -> list[Array]:
        """Return the channels, (n,) each, one value a cycle; the last is measured, the others are commands.

        Commands are interpolated linearly over missed ticks. A missing measurement is NaN, unless its gap is
        short enough for interpolation between its neighbours.
        """
        ran = np.array(self._cycles)
        *commands, measured = self.columns()
        cycles = np.arange(ran[0], ran[-1] + 1.0)
        found = np.full(len(cycles), np.nan)
        found[(ran - ran[0]).astype(np.int64)] = measured
        return [*(np.interp(cycles, ran, command) for command in commands), bridged(found)]


def travel_collector(config: MachineConfig, axis: str) -> Collector:
    """Make the collector of a screw-learning travel; see `learning.screw_travel.passes_of`."""
    channels = ("position_command_m", "correction_m", "motor_position_m", "scale_position_m")
    return Collector(config, axis, channels)


def stroke_collector(config: MachineConfig, axis: str) -> Collector:
    """Make the collector of position command and position, of the scale or, without one, of the motor."""
    measured = "motor_position_m" if config.axes[axis].scale is None else "scale_position_m"
    return Collector(config, axis, ("position_command_m", measured))


def waveform_collector(config: MachineConfig, axis: str) -> Collector:
    """Make the collector of the commands, and of the error against the feedback of the position loop."""
    return Collector(config, axis, ("position_command_m", "velocity_command_m_s", "position_error_m"))


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
