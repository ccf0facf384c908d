"""Positioning on random precision stages: `python -m studies.wang_2014.random_study --json FILE`.

One procedure: the gain of the sampled loop beside the table, and its corrections at an end point, are
searched on training stages, and the kind of an input shaper on further ones; every setting is then judged on
other stages, from a cold start, at targets off the grid. Each stage learns its own screw table, and its swing
is measured. All in the batch twin.
"""

import argparse
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.metrology.iso_230_2 import positioning
from servo_ctrl.motion.input_shaper import ShaperKind
from studies.wang_2014.plan import AXIS, stage_machine
from studies.wang_2014.random_stages import RandomStage, random_stages
from studies.wang_2014.readings import Deviations, deviations
from studies.wang_2014.stages import STAGES, Stage
from studies.wang_2014.study import AIM_UM, UM
from studies.wang_2014.swing import measured_swing
from studies.wang_2014.twin_screw import learn_screw
from studies.wang_2014.twin_study import Twin, positioned, powered_up
from twin.plant_file import load_plant

MACHINE = Path(__file__).parents[2] / "machines" / "precision_stage"
TRAINING_SEED, SEED = 2013, 2014
"""Seeds of the stages for training and of the measured ones; chosen."""
TRAINING_STAGES = 3
"""Number of stages for training; chosen."""
SHAPER_SEED, SHAPER_STAGES = 2015, 20
"""Seed and number of the stages on which the input shaper is chosen; chosen: the three have no slow arm."""
CYCLES = 5
"""Of a series, from power-up: six minutes, in which the screw takes on half of the change of the room."""
GAINS, CORRECTIONS = (1.0, 0.25, 0.1, 0.05, 0.02), (1, 5)
"""Tried gains of a correction, and tried numbers of corrections at an end point; chosen."""
COMPARED = ("smoothed", "screw_table", "screw_table_sampled")
TRIMMED = "screw_table_trimmed"
"""Table and sampled loop with the gain and the corrections of the search."""
SHAPED = "screw_table_shaped"
"""The same, with an input shaper for the measured swing."""
SHAPERS: tuple[ShaperKind | None, ...] = (None, "zv", "zvd")


def trimmed(gain: float, corrections: int) -> Stage:
    """Return the screw table with a sampled loop beside it that takes this share of a deviation."""
    return STAGES["screw_table_sampled"]._replace(name=TRIMMED, gain=gain, corrections=corrections)


def commissioned(drawn: RandomStage) -> Twin:
    """Return the stage with its learned table and its measured swing, each after a power-up of its own."""
    twin = Twin(MACHINE, drawn.plant)
    machine = stage_machine(MACHINE, STAGES["screw_table"])
    params = axis_params(machine, AXIS)
    learned = learn_screw(machine, AXIS, powered_up(twin, machine, params).rollout, params)
    plain = stage_machine(MACHINE, STAGES["uncompensated"])
    swing = measured_swing(plain, powered_up(twin, plain, axis_params(plain, AXIS)).rollout)
    return twin._replace(screw=learned, swing=swing)


def deviations_on(twin: Twin, drawn: RandomStage, setting: Stage) -> Deviations:
    """Return the deviations of one setting on one stage, from power-up on."""
    series = drawn.series
    readings = positioned(twin, setting, series, series.most_runs, lambda: None)
    return deviations(readings)[series.name, setting.name]


def figures_of(found: Deviations) -> dict[str, float]:
    """Return what is judged, um: largest |deviation| by both instruments, drift, A, R, E and B."""
    truth, mean_m = positioning(found.interferometer_m), found.interferometer_m.mean(axis=(1, 2))
    return {
        "largest_um": float(np.abs(found.interferometer_m).max()) * UM,
        "largest_by_scale_um": float(np.abs(found.scale_m).max()) * UM,
        "drift_um": float(mean_m[-1] - mean_m[0]) * UM,
        "A_um": truth.accuracy_m * UM,
        "R_um": truth.repeatability_m * UM,
        "E_um": truth.systematic_m * UM,
        "B_um": truth.reversal_m * UM,
    }


def searched(drawn: Sequence[RandomStage], pool: ThreadPoolExecutor) -> list[dict[str, float]]:
    """Return each gain and number of corrections with its cost: mean largest |deviation|, um; least first."""
    twins = list(pool.map(commissioned, drawn))
    settings = list(product(GAINS, CORRECTIONS))

    def cost(setting: tuple[float, int]) -> float:
        stage = trimmed(*setting)
        largest = [
            figures_of(deviations_on(twin, one, stage))["largest_um"]
            for twin, one in zip(twins, drawn, strict=True)
        ]
        return float(np.mean(largest))

    rows = [
        {"gain": gain, "corrections": corrections, "cost_um": found_um}
        for (gain, corrections), found_um in zip(settings, pool.map(cost, settings), strict=True)
    ]
    return sorted(rows, key=lambda row: row["cost_um"])


def shapers_tried(
    drawn: Sequence[RandomStage], setting: Stage, pool: ThreadPoolExecutor
) -> list[dict[str, Any]]:
    """Return each kind of shaper with the mean and the largest deviation over the stages, um; least first."""
    twins = list(pool.map(commissioned, drawn))

    def largest_um(kind: ShaperKind | None) -> list[float]:
        shaped = setting._replace(shaper=kind)
        pairs = zip(twins, drawn, strict=True)
        return [figures_of(deviations_on(twin, one, shaped))["largest_um"] for twin, one in pairs]

    rows = [
        {"shaper": kind, "cost_um": float(np.mean(found)), "worst_um": max(found)}
        for kind, found in zip(SHAPERS, pool.map(largest_um, SHAPERS), strict=True)
    ]
    return sorted(rows, key=lambda row: row["cost_um"])


def judged(drawn: RandomStage, settings: Sequence[Stage]) -> dict[str, dict[str, float]]:
    """Return the figures of every setting on one stage."""
    twin = commissioned(drawn)
    return {setting.name: figures_of(deviations_on(twin, drawn, setting)) for setting in settings}


def main() -> None:
    """Search on the training stages, judge on the others; write JSON after each."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--stages", type=int, default=20)
    parser.add_argument("--json", type=Path, required=True)
    options = parser.parse_args()
    plant = load_plant(MACHINE)
    training = list(random_stages(plant, AXIS, TRAINING_STAGES, TRAINING_SEED, CYCLES))
    with ThreadPoolExecutor(max_workers=len(os.sched_getaffinity(0))) as pool:
        search = searched(training, pool)
        best = search[0]
        alone = trimmed(best["gain"], int(best["corrections"]))
        further = list(random_stages(plant, AXIS, SHAPER_STAGES, SHAPER_SEED, CYCLES))
        shapers = shapers_tried(further, alone, pool)
        shaped = alone._replace(name=SHAPED, shaper=shapers[0]["shaper"])
        settings = [*(STAGES[name] for name in COMPARED), alone, shaped]
        figures: dict[str, Any] = {"made": "batch twin", "aim_um": AIM_UM, "cycles": CYCLES, "seed": SEED}
        figures |= {"search": search, "shapers": shapers, "stages": []}
        drawn = random_stages(plant, AXIS, options.stages, SEED, CYCLES)
        for found in pool.map(lambda one: judged(one, settings), drawn):
            figures["stages"].append(found)
            write_figures(options.json, figures)


if __name__ == "__main__":
    main()
