"""Friction that changes with temperature in production: adaptation alone, and with a level over temperature.

    python -m studies.feng_2015.waveform_temperature --json docs/friction_temperature.json

Random tables (mass +-30 %, every parameter of friction +-50 %) whose levels and damping change by 0.4 to 1.4
when warm, and as many whose friction does not. Each learns cold, then produces for two days
(`production_days`) with a sensor of its guide, with one that sticks, and with one of something else.
"""

import argparse
import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import PlantConfig, TemperatureProbe
from hil_sim.drive.temperature_probe import STEP_K, ProbeReading
from hil_sim.physics.friction import temperature_dependent_friction
from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from studies.feng_2015.production_days import Produced, Thermometer, no_thermometer, produce
from studies.feng_2015.waveform_learning import learn_waveforms
from studies.feng_2015.waveform_robustness import MACHINE
from studies.random_plants import random_plant
from twin.plant_file import load_plant

FIRST_SEED = 2000
"""Seeds of the tables from here on; those below 1100 were looked at while the schedule was made."""
WARM_SHARE = (0.4, 1.4)
WARMTH_SCALE_K, RESISTANCE_K_W, WARM_UP_S = (5.0, 15.0), (80.0, 160.0), (100.0, 200.0)
"""Ranges that are drawn from; chosen: a rise of 5 to 25 K within minutes at the power of these parts."""
STUCK_DEGC = 31.4
FIRST = 4
"""Reversals behind a start that are judged by themselves; chosen: adaptation needs four."""


class DrawnTable(NamedTuple):
    """A table, and the axis that produces."""

    seed: int
    plant: PlantConfig
    axis: str
    warm_level_share: float


def drawn_table(plant: PlantConfig, seed: int, *, warms: bool = True) -> DrawnTable:
    """Return a random table; unless it `warms`, its temperature changes and its friction does not."""
    rng = np.random.default_rng(seed)
    drawn, axis = random_plant(plant, rng), list(plant.axes)[seed % len(plant.axes)]
    levels, damping = rng.uniform(*WARM_SHARE, size=2) if warms else (1.0, 1.0)
    scale_k, resistance_k_w, warm_up_s = (
        float(rng.uniform(*bounds)) for bounds in (WARMTH_SCALE_K, RESISTANCE_K_W, WARM_UP_S)
    )
    heat = temperature_dependent_friction.Params(
        warm_level_share=float(levels),
        warm_damping_share=float(damping),
        warmth_scale_k=scale_k,
        heat_capacity_j_k=warm_up_s / resistance_k_w,
        resistance_k_w=resistance_k_w,
    )
    own = drawn.axes[axis]
    effects = {**own.effects, "temperature_dependent_friction": heat}
    axes = {**drawn.axes, axis: own.model_copy(update={"effects": effects})}
    return DrawnTable(seed, drawn.model_copy(update={"axes": axes}), axis, float(levels))


def at_the_guide(seed: int) -> Thermometer:
    """Return the simulator's thermometer."""
    reading = ProbeReading(TemperatureProbe(), seed)
    return lambda now_s, rise_k: reading.counts(now_s, rise_k) * STEP_K


def elsewhere(seed: int) -> Thermometer:
    """Return one that is likewise, of something that has nothing to do with the axis: it swings by +-9 K."""
    reading = ProbeReading(TemperatureProbe(), seed)
    phase = float(np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi))

    def read_degc(now_s: float, _rise_k: float) -> float:
        swing_k = 6.0 * math.sin(now_s / 60.0 + phase) + 3.0 * math.sin(now_s / 23.0 + 2.0 * phase)
        return reading.counts(now_s, 8.0 + swing_k) * STEP_K

    return read_degc


def stuck(_now_s: float, _rise_k: float) -> float:
    """Return always the same."""
    return STUCK_DEGC


def figures_um(reversals: list[Produced]) -> dict[str, float]:
    """Return mean J, micrometres: behind the second cold start, in its warm-up, behind pauses, of all."""
    first = [r for r in reversals if r.day and not r.batch and r.number < FIRST]
    warming = [r for r in reversals if r.day and not r.batch and r.number >= FIRST]
    pauses = [r for r in reversals if r.batch and r.number < FIRST]
    groups = {"cold_start": first, "warm_up": warming, "behind_pauses": pauses, "all": reversals}
    return {
        name: round(1e6 * float(np.mean([r.error_m for r in group])), 4) for name, group in groups.items()
    }


def measured(machine: MachineConfig, table: DrawnTable, *, warms: bool) -> dict[str, Any]:
    """Return the figures of one table by course."""
    learned = learn_waveforms(machine, table.plant, table.axis).learned
    thermometers = {
        "adaptation": no_thermometer,
        "schedule": at_the_guide(table.seed),
        "misleading": elsewhere(table.seed),
    }
    courses = {
        name: produce(machine, table.plant, table.axis, learned, thermometer)
        for name, thermometer in thermometers.items()
    }
    if warms:
        courses["stuck"] = produce(machine, table.plant, table.axis, learned, stuck)
        courses["unchanged"] = produce(machine, table.plant, table.axis, learned, adapts=False)
    return {
        "seed": table.seed,
        "axis": table.axis,
        "warm_level_share": round(table.warm_level_share, 4),
        "J_um": {name: figures_um(found) for name, found in courses.items()},
    }


def main() -> None:
    """Measure the tables that warm, and those whose friction stays."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--json", type=Path, required=True)
    parser.add_argument("--tables", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    options = parser.parse_args()
    machine, plant = load_machine(MACHINE), load_plant(MACHINE)
    seeds = range(options.first_seed, options.first_seed + options.tables)

    def of_kind(*, warms: bool) -> list[dict[str, Any]]:
        with ThreadPoolExecutor() as threads:
            return list(
                threads.map(
                    lambda seed: measured(machine, drawn_table(plant, seed, warms=warms), warms=warms), seeds
                )
            )

    kinds = {"warming": of_kind(warms=True), "constant": of_kind(warms=False)}
    write_figures(options.json, {"made": "batch twin", **kinds})


if __name__ == "__main__":
    main()
