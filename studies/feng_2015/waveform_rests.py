"""Measures the force that is learned for rests (`learning.rests_s`) on starts that no learning saw.

    python -m studies.feng_2015.waveform_rests --json docs/friction_rests.json

Random tables whose breakaway grows with the time at rest, and the same ones without that. Each axis learns
once, with rests; without them it uses the same waveforms. Each table is judged on moves behind random rests,
in the batch twin: without compensation, with LWC, and with LWC that knows rests.
"""

import argparse
import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import AxisPlant, PlantConfig
from hil_sim.physics.friction import dwell_dependent_breakaway
from servo_ctrl.config.kernel_params import axis_params, motion_limits
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.learning.performance import window_samples
from servo_ctrl.learning.rest_strokes import moves_behind_rests
from servo_ctrl.motion.move import Dwell, Move
from servo_ctrl.motion.program import Step
from servo_ctrl.units import MM, MM_MIN, UM
from studies.feng_2015.waveform_conditions import random_tables
from studies.feng_2015.waveform_learning import learn_waveforms, with_learned
from studies.feng_2015.waveform_robustness import MACHINE, rounded
from studies.random_plants import each_axis
from studies.twin_axis import motion, twin_axis
from twin.plant_file import load_plant

SEED = 60728
"""Of tables and moves; chosen, and used once."""
RESTS_S = (0.3, 3.0, 30.0)
"""Rests that are learned: the example of the setting."""
GROWTH_SHARE, TIME_S, WAY_M = (0.05, 0.4), (0.3, 20.0), (5e-6, 100e-6)
"""Least and most growth of the breakaway, as a share of the Coulomb level, its time constant, and the travel
that takes it away; chosen before anything was measured. The last two are drawn over their logarithm."""
STARTS, REST_S, LENGTH_M, HALF_M = 24, (0.05, 60.0), (5e-3, 20e-3), 40e-3
"""Starts on each axis of each table, least and longest rest before one, length of a move, and its bound."""
ACCELERATION_M_S2, FEED_MM_MIN = 0.05, (500.0, 3000.0)
"""Least acceleration, up to the limit of the axis; least and largest feed."""
VARIANTS = ("without", "LWC", "LWC, rests")


class Start(NamedTuple):
    """The move behind a rest."""

    rest_s: float
    move: Move


def random_starts(machine: MachineConfig, axis: str, rng: np.random.Generator) -> Iterator[Start]:
    """Yield moves that go on or turn back at random, each with the rest before it."""
    index, at_m, limits = list(machine.axes).index(axis), 0.0, motion_limits(machine)
    for _ in range(STARTS):
        length_m = rng.uniform(*LENGTH_M) * rng.choice((-1.0, 1.0))
        at_m += -length_m if abs(at_m + length_m) > HALF_M else length_m
        to_m = [np.nan] * len(machine.axes)
        to_m[index] = at_m
        acceleration_m_s2 = _log_uniform(rng, ACCELERATION_M_S2, float(limits.acceleration_m_s2[index]))
        feed_m_s = rng.uniform(*FEED_MM_MIN) * MM_MIN
        move = Move("start", tuple(to_m), feed_m_s, acceleration_m_s2, trapezoidal=False)
        yield Start(round(_log_uniform(rng, *REST_S), 3), move)


def _log_uniform(rng: np.random.Generator, least: float, most: float) -> float:
    return float(np.exp(rng.uniform(np.log(least), np.log(most))))


def with_growth(plant: PlantConfig, rng: np.random.Generator) -> PlantConfig:
    """Return the plant with a breakaway that grows at rest, drawn for each axis."""

    def changed(axis: AxisPlant) -> AxisPlant:
        growth_n = rng.uniform(*GROWTH_SHARE) * axis.effects["coulomb_friction"].coulomb_n
        drawn = dwell_dependent_breakaway.Params(
            growth_n, _log_uniform(rng, *TIME_S), _log_uniform(rng, *WAY_M)
        )
        return axis.model_copy(update={"effects": axis.effects | {"dwell_dependent_breakaway": drawn}})

    return each_axis(plant, changed)


def judged(
    machine: MachineConfig, plant: PlantConfig, axis: str, params: AxisParams, starts: list[Start]
) -> dict[str, list[float]]:
    """Return mean, peak and RMS of the error over Tm behind each rest, micrometres."""
    steps: list[Step] = [starts[0].move]
    for rest_s, move in starts[1:]:
        steps += [Dwell("rest", rest_s), move]
    period_s = machine.period_s
    window = window_samples(machine.monitoring.window_s, period_s)
    reference = motion(machine, axis, [*steps, Dwell("end", window * period_s)])
    begins = moves_behind_rests(reference[:, 0], REST_S[0], period_s)[1 - len(starts) :]
    error_m = twin_axis(machine, plant, axis, params).rollout.rows(reference)["position_error_m"]
    parts_um = np.array([error_m[begin : begin + window] for begin in begins]) / UM
    return {
        "mean_um": np.abs(parts_um).mean(axis=1).tolist(),
        "peak_um": np.abs(parts_um).max(axis=1).tolist(),
        "rms_um": np.sqrt((parts_um**2).mean(axis=1)).tolist(),
    }


def measured(
    machine: MachineConfig, plant: PlantConfig, axis: str, rng: np.random.Generator
) -> dict[str, Any]:
    """Learn on an axis, and judge the starts behind rests."""
    learned = learn_waveforms(machine, plant, axis).learned
    plain = axis_params(machine, axis)
    variants = (plain, with_learned(plain, learned._replace(rests=())), with_learned(plain, learned))
    starts = list(random_starts(machine, axis, rng))
    ways_m = np.diff([0.0, *(np.nansum(start.move.to_m) for start in starts)])
    drawn = {}
    if (growth := plant.axes[axis].effects.get("dwell_dependent_breakaway")) is not None:
        drawn = {"growth_n": growth.growth_n, "time_s": growth.time_s, "way_um": growth.way_m / UM}
    return {
        "axis": axis,
        **drawn,
        "strokes": learned.strokes,
        "rest_s": [start.rest_s for start in starts[1:]],
        "turned": (ways_m[1:] * ways_m[:-1] < 0.0).tolist(),
        "acceleration_mm_s2": [start.move.acceleration_m_s2 / MM for start in starts[1:]],
        **{
            name: judged(machine, plant, axis, params, starts)
            for name, params in zip(VARIANTS, variants, strict=True)
        },
    }


def study(tables: int, seed: int) -> dict[str, Any]:
    """Return the figures of all tables, with and without the effect."""
    machine, plant = load_machine(MACHINE), load_plant(MACHINE)
    learning = machine.learning.model_copy(update={"rests_s": list(RESTS_S)})
    machine = machine.model_copy(update={"learning": learning})
    conditions = list(random_tables(machine, plant, tables, seed))
    figures: dict[str, Any] = {"seed": seed, "made": "batch twin", "rests_s": RESTS_S, "variants": VARIANTS}
    for key, grows in (("growing", True), ("constant", False)):
        rng = np.random.default_rng(seed)
        plants = [with_growth(entry.plant, rng) if grows else entry.plant for entry in conditions]
        cases = [
            (machine, table, axis, np.random.default_rng((seed, number, place)))
            for number, table in enumerate(plants)
            for place, axis in enumerate(machine.axes)
        ]
        with ThreadPoolExecutor() as threads:
            figures[key] = list(threads.map(lambda case: measured(*case), cases))
    return figures


def main() -> None:
    """Measure, and write JSON."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--tables", type=int, default=20)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--json", type=Path, required=True)
    options = parser.parse_args()
    figures = rounded(study(options.tables, options.seed))
    write_text_whole(options.json, json.dumps(figures, separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main()
