"""Two days of production on one axis of the batch twin whose friction changes with its temperature.

Half turns of a circle at alternating feeds, from rest to rest, with pauses; the second day begins cold. While
the axis rests the lubricant cools by its closed form, and nothing is simulated.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hil_sim.config import PlantConfig
from kernels.arrays import Array
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.learning import waveform_settings
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.learning.level_over_temperature import relative_to
from servo_ctrl.learning.performance import evaluation_m, window_samples
from servo_ctrl.learning.reversal_waveform import WaveformLearned
from servo_ctrl.learning.temperature_input import TemperatureInput, after_reading
from servo_ctrl.learning.waveform_adaptation import (
    AdaptationState,
    ProductionReversal,
    at_temperature,
    next_state,
)
from studies.feng_2015.waveform_learning import with_learned
from studies.twin_axis import twin_axis

RADIUS_M, FEEDS_M_S = 0.01, (2.0 / 60.0, 1.0 / 60.0)
"""Chosen: reversals every 0.9 and 1.9 s, at 111 and 28 mm/s^2."""
REVERSALS = 16
"""Reversals of a part; even, so that parts follow each other. Chosen."""
RAMP_S = 0.5
"""Speed ramp at both ends of a part, seconds; chosen."""


class Batch(NamedTuple):
    """Parts in a row, and the pause behind them."""

    parts: int
    pause_s: float


START_S, NIGHT_S = 30.0, 12.0 * 3600.0
"""From power to the first part, and from day to day, seconds; chosen: boot, homing, start of a program."""
DAYS = ((Batch(14, 90.0), Batch(4, 300.0), Batch(4, 150.0), Batch(4, 0.0)), (Batch(14, 200.0), Batch(4, 0.0)))
"""Batches by day; chosen: two cold starts with their warm-ups, and pauses in which the axis cools partly."""
Thermometer = Callable[[float, float], float]
"""Time s and rise of the lubricant K to the reading, degC; NaN: none."""


class Produced(NamedTuple):
    """One reversal."""

    day: int
    batch: int
    number: int
    """Within its batch."""
    error_m: float
    """J."""


def no_thermometer(_now_s: float, _rise_k: float) -> float:
    """Return no reading."""
    return math.nan


def part(feed_m_s: float, period_s: float) -> tuple[Array, list[int]]:
    """Return the commands (n, 4) of `REVERSALS` half turns from rest to rest, and the reversals' samples."""
    speed_rad_s = feed_m_s / RADIUS_M
    total_s = REVERSALS * math.pi / speed_rad_s + RAMP_S
    time_s = np.arange(round(total_s / period_s) + 1, dtype=np.float64) * period_s
    up, down = _ramp(time_s), _ramp(time_s - (total_s - RAMP_S))
    angle, rate, change = (speed_rad_s * (first - last) for first, last in zip(up, down, strict=True))
    commands = np.zeros((len(time_s), 4))
    commands[:, 0] = np.sin(angle)
    commands[:, 1] = rate * np.cos(angle)
    commands[:, 2] = change * np.cos(angle) - rate**2 * np.sin(angle)
    direction = np.sign(np.diff(commands[:, 0]))
    return RADIUS_M * commands, (np.flatnonzero(direction[1:] * direction[:-1] < 0.0) + 2).tolist()


def _ramp(since_s: Array) -> tuple[Array, Array, Array]:
    """Angle (s), speed and acceleration (1/s) of a ramp that begins at 0 and ends at speed 1."""
    share = np.clip(since_s / RAMP_S, 0.0, 1.0)
    angle_s = RAMP_S * (share**3 - 0.5 * share**4) + np.maximum(since_s - RAMP_S, 0.0)
    return angle_s, 3.0 * share**2 - 2.0 * share**3, 6.0 * (share - share**2) / RAMP_S


def produce(
    machine: MachineConfig,
    plant: PlantConfig,
    axis: str,
    learned: WaveformLearned,
    thermometer: Thermometer = no_thermometer,
    *,
    adapts: bool = True,
) -> list[Produced]:
    """Produce for all `DAYS` and return the reversals; what was adapted is kept from day to day."""
    found, now_s = [], 0.0
    for number, batches in enumerate(DAYS):
        day = _Day(machine, plant, axis, learned, thermometer, now_s, adapts=adapts)
        day.rest(START_S)
        for place, batch in enumerate(batches):
            errors_m = [error_m for index in range(batch.parts) for error_m in day.produce_part(index)]
            found += [Produced(number, place, index, error_m) for index, error_m in enumerate(errors_m)]
            day.rest(batch.pause_s)
        learned, now_s = day.stored(), day.now_s + NIGHT_S
    return found


class _Day:
    """From a cold power-up on, as the daemon does it: a reading of the temperature a second or a reversal."""

    def __init__(
        self,
        machine: MachineConfig,
        plant: PlantConfig,
        axis: str,
        learned: WaveformLearned,
        thermometer: Thermometer,
        now_s: float,
        *,
        adapts: bool,
    ) -> None:
        settings, self._plain = waveform_settings(machine, axis), axis_params(machine, axis)
        self._loop, self._period_s = settings.loop, machine.period_s
        self._window = window_samples(settings.sines.window_s, machine.period_s)
        heat = plant.axes[axis].effects["temperature_dependent_friction"]
        self._cooling_s = heat.heat_capacity_j_k * heat.resistance_k_w
        twin = twin_axis(machine, plant, axis, with_learned(self._plain, learned))
        self._rollout, self._warmth = twin.rollout, twin.plant_state["temperature_dependent_friction"]
        self._thermometer, self._temperature, self._adapts = thermometer, TemperatureInput(), adapts
        self._state = AdaptationState(learned, schedule=learned.schedule)
        self._parts = [part(feed_m_s, machine.period_s) for feed_m_s in FEEDS_M_S]
        self.now_s = now_s

    def produce_part(self, index: int) -> list[float]:
        """Return J (m) of the reversals of a part; feeds alternate."""
        commands, starts = self._parts[index % len(self._parts)]
        errors_m: list[float] = []
        first = 0
        for start in starts:
            end = start + self._window
            error_m = self._moved(commands[first:end])[-self._window :]
            first = end
            errors_m.append(evaluation_m(error_m))
            direction = float(np.sign(commands[start, 0] - commands[start - 1, 0]))
            a_m_s2 = abs(float(commands[start, 2]))
            degc = self._temperature.degc
            reversal = ProductionReversal(a_m_s2, direction * error_m, errors_m[-1], degc)
            if self._adapts:
                self._state = next_state(self._state, self._loop, reversal)
        self._moved(commands[first:])
        return errors_m

    def rest(self, pause_s: float) -> None:
        """Stand still; the lubricant cools."""
        for _ in range(round(pause_s)):
            self._warmth["temperature_rise_k"] *= math.exp(-1.0 / self._cooling_s)
            self._passed(1.0)

    def stored(self) -> WaveformLearned:
        """Return what is stored at the end of the day."""
        return self._state.learned._replace(schedule=relative_to(self._state.schedule, self._state.level))

    def _moved(self, commands: Array) -> Array:
        """Errors (n,), metres, of a motion with the waveform in use."""
        self._rollout.change_params(with_learned(self._plain, self._state.learned))
        error_m = np.asarray(self._rollout.rows(commands)["position_error_m"], np.float64)
        self._passed(len(commands) * self._period_s)
        return error_m

    def _passed(self, elapsed_s: float) -> None:
        self.now_s += elapsed_s
        degc = self._thermometer(self.now_s, float(self._warmth["temperature_rise_k"]))
        self._temperature = after_reading(self._temperature, degc)
        if self._adapts:
            self._state = at_temperature(self._state, self._loop, self._temperature.degc, elapsed_s)
