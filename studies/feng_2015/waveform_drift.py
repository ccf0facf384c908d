"""Friction changes in production: the learned waveform adapts from reversals alone, in the batch twin.

    python -m studies.feng_2015.waveform_drift --json docs/friction_recovery.json

One axis moves as in a circle. After some reversals its friction changes at once; no learning stroke follows.
"""

import argparse
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import PlantConfig
from hil_sim.physics.friction import lubrication_loss
from kernels.arrays import Array
from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.learning import waveform_settings
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learning.performance import evaluation_m, window_samples
from servo_ctrl.learning.reversal_waveform import WaveformLearned
from servo_ctrl.learning.waveform_adaptation import AdaptationState, ProductionReversal, next_state
from studies.feng_2015.waveform_learning import learn_waveforms, with_learned
from studies.twin_axis import twin_axis
from twin.plant_file import load_plant

MACHINE = Path(__file__).parents[2] / "machines" / "xy_table"
FEEDS_MM_MIN = (500, 1000, 2000, 3000)
LEVEL_FACTORS = (1.8, 0.6)
"""Factors of the friction levels: as in `plant_lubrication_loss.toml`, and one that falls, chosen."""

BEFORE = 6
"""Reversals before the friction rises; chosen."""
RAMP_S = 0.5
"""Speed ramp of a circle, seconds; chosen."""


class Recovery(NamedTuple):
    """J (m) of each reversal: with adaptation, with the functions unchanged, and without compensation."""

    adapted_m: list[float]
    stale_m: list[float]
    without_m: list[float]


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
    plain, settings = axis_params(machine, axis), waveform_settings(machine, axis)
    window = window_samples(settings.sines.window_s, machine.period_s)

    def course(params: AxisParams, *, adapts: bool = False) -> list[float]:
        twin = twin_axis(machine, changed, axis, params).rollout
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
                twin.change_params(with_learned(plain, state.learned))
        return errors_m

    acting = with_learned(plain, learned)
    return Recovery(course(acting, adapts=True), course(acting), course(plain))


def main() -> None:
    """Measure each axis at each feed, with more friction and with less."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--json", type=Path, required=True)
    options = parser.parse_args()
    machine, plant = load_machine(MACHINE), load_plant(MACHINE)

    def of_axis(axis: str) -> list[dict[str, Any]]:
        learned = learn_waveforms(machine, plant, axis).learned
        rows = []
        for level_factor, feed_mm_min in product(LEVEL_FACTORS, FEEDS_MM_MIN):
            found = recovery(machine, plant, axis, learned, feed_mm_min / 60e3, level_factor=level_factor)
            named = {"axis": axis, "feed_mm_min": feed_mm_min, "level_factor": level_factor}
            courses = {
                name.replace("_m", "_J_um"): [round(1e6 * value_m, 4) for value_m in values_m]
                for name, values_m in found._asdict().items()
            }
            rows.append({**named, **courses})
        return rows

    with ThreadPoolExecutor() as threads:
        courses = [row for rows in threads.map(of_axis, machine.axes) for row in rows]
    write_figures(options.json, {"made": "batch twin", "before": BEFORE, "courses": courses})


if __name__ == "__main__":
    main()
