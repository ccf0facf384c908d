"""Friction rises in production: the learned waveform adapts from reversals alone, in the batch twin.

One axis moves as in a circle. After some reversals its friction rises at once; no learning stroke follows.
"""

from typing import NamedTuple

import numpy as np

from hil_sim.config import PlantConfig
from hil_sim.physics.friction import lubrication_loss
from kernels.arrays import Array
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.learning import waveform_settings
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.learning.performance import evaluation_m, window_samples
from servo_ctrl.learning.reversal_waveform import WaveformLearned
from servo_ctrl.learning.waveform_adaptation import AdaptationState, ProductionReversal, next_state
from studies.feng_2015.waveform_learning import with_learned
from studies.twin_axis import twin_axis

BEFORE = 6
"""Reversals before the friction rises; chosen."""
RAMP_S = 0.5
"""Speed ramp of a circle, seconds; chosen."""


class Recovery(NamedTuple):
    """J (m) of each reversal: with adaptation, and with the functions unchanged."""

    adapted_m: list[float]
    stale_m: list[float]


def with_loss(plant: PlantConfig, axis: str, start_s: float, level_factor: float) -> PlantConfig:
    """Return the plant with friction levels that rise by a factor at this time."""
    loss = lubrication_loss.Params(start_s, 0.01, level_factor, 1.0)
    own = plant.axes[axis]
    changed = own.model_copy(update={"effects": {**own.effects, "lubrication_loss": loss}})
    return plant.model_copy(update={"axes": {**plant.axes, axis: changed}})


def rounds(radius_m: float, feed_m_s: float, reversals: int, period_s: float) -> tuple[Array, list[int]]:
    """Return commands (n, 4) of one axis of a circle from standstill, and the samples of its reversals."""
    speed_rad_s = feed_m_s / radius_m
    count = round((RAMP_S + (reversals + 0.5) * np.pi / speed_rad_s) / period_s)
    time_s = np.arange(count) * period_s
    share = np.clip(time_s / RAMP_S, 0.0, 1.0)
    # the angle begins at rest: its speed rises as 3 s^2 - 2 s^3
    rising = RAMP_S * (share**3 - 0.5 * share**4)
    angle = speed_rad_s * (rising + np.maximum(time_s - RAMP_S, 0.0))
    rate = speed_rad_s * (3.0 * share**2 - 2.0 * share**3)
    change = np.where(share < 1.0, speed_rad_s * 6.0 * (share - share**2) / RAMP_S, 0.0)
    commands = np.zeros((count, 4))
    commands[:, 0] = radius_m * np.sin(angle)
    commands[:, 1] = radius_m * rate * np.cos(angle)
    commands[:, 2] = radius_m * (change * np.cos(angle) - rate**2 * np.sin(angle))
    increments = np.sign(np.diff(commands[:, 0]))
    starts = (np.flatnonzero(np.diff(increments)) + 2).tolist()
    return commands, [start for start in starts if start > RAMP_S / period_s][:reversals]


def recovery(
    machine: MachineConfig,
    plant: PlantConfig,
    axis: str,
    learned: WaveformLearned,
    feed_m_s: float,
    *,
    level_factor: float = 1.8,
    radius_m: float = 0.025,
    after: int = 24,
) -> Recovery:
    """Measure J of `BEFORE` reversals, and of `after` more with the changed friction."""
    commands, starts = rounds(radius_m, feed_m_s, BEFORE + after, machine.period_s)
    halfway_s = 0.5 * (starts[BEFORE - 1] + starts[BEFORE]) * machine.period_s
    changed = with_loss(plant, axis, halfway_s, level_factor)
    return Recovery(
        *(
            _course(machine, changed, axis, learned=learned, commands=commands, starts=starts, adapts=adapts)
            for adapts in (True, False)
        )
    )


def _course(
    machine: MachineConfig,
    plant: PlantConfig,
    axis: str,
    learned: WaveformLearned,
    commands: Array,
    starts: list[int],
    *,
    adapts: bool,
) -> list[float]:
    settings = waveform_settings(machine, axis)
    window = window_samples(settings.sines.window_s, machine.period_s)
    params = axis_params(machine, axis)
    twin = twin_axis(machine, plant, axis, with_learned(params, learned)).rollout
    state, errors_m, first = AdaptationState(learned), [], 0
    for start in starts:
        rows = twin.rows(commands[first : start + window])
        error_m = np.asarray(rows["position_error_m"], np.float64)[-window:]
        first = start + window
        direction = float(np.sign(commands[start, 0] - commands[start - 1, 0]))
        reversal = ProductionReversal(
            abs(float(commands[start, 2])), direction * error_m, evaluation_m(error_m)
        )
        errors_m.append(reversal.error_m)
        if adapts:
            state = next_state(state, settings.loop, reversal)
            twin.change_params(with_learned(params, state.learned))
    return errors_m
