"""Both position laws on random tables: `python -m studies.xia_fuzzy_pd.random_tables --json FILE`.

The gains are those of the machine files, found by `position_tuning` on other plants and motions; nothing is
tuned here. Each table has the step and the sine of the study, and a step to a target of its own. All in the
batch twin.
"""

import argparse
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import AxisPlant, PlantConfig
from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.motion.move import Dwell, Move
from servo_ctrl.motion.program import Step
from servo_ctrl.motion.sine import Sine
from studies.random_plants import MASS_SHARE, random_plant, varied
from studies.twin_axis import REST_CYCLES, motion, twin_axis
from studies.xia_fuzzy_pd.figures import sine_figures, step_figures
from studies.xia_fuzzy_pd.study import AXIS, CONTROLLERS
from twin.plant_file import load_plant

MACHINE = Path(__file__).parents[2] / "machines" / "fuzzy_table"
SEED = 2007
"""Seed of the random tables; chosen."""
STEP_M, HOLD_S = 1e-3, 1.0
"""Step and the time it is held, from programs/position.toml."""
SINE = (5e-3, 0.5, 5.0)
"""Amplitude m, frequency Hz, cycles; from programs/position.toml."""
LEAST_M, MOST_M = 0.05e-3, 4e-3
"""Bounds of the step of each table's own, drawn by decades; chosen."""
TRAIN_SHARE = 0.3
"""Largest relative deviation of the stiffness of the drive train; chosen."""
WORN_SHARE = 0.5
"""The same of its damping and its play; chosen."""
REST_S = 0.2
"""Time at the end of a hold in which the table counts as at rest; as in the tuning."""
AIM_UM = 0.5
"""Of the deviation at rest; from the task."""


class RandomTable(NamedTuple):
    """A drawn table, and the size of its own step (m)."""

    plant: PlantConfig
    step_m: float


def random_tables(plant: PlantConfig, count: int, seed: int) -> Iterator[RandomTable]:
    """Yield `count` tables: masses, friction and drive train drawn independently."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        drawn = random_plant(plant, rng)
        axes = {**drawn.axes, AXIS: _drawn(drawn.axes[AXIS], rng)}
        step_m = LEAST_M * (MOST_M / LEAST_M) ** float(rng.uniform())
        yield RandomTable(drawn.model_copy(update={"axes": axes}), step_m)


def _drawn(axis: AxisPlant, rng: np.random.Generator) -> AxisPlant:
    train, play = axis.effects["drive_compliance"], axis.effects["backlash"]
    effects = axis.effects | {
        "drive_compliance": train._replace(
            stiffness_n_m=varied(train.stiffness_n_m, TRAIN_SHARE, rng),
            damping_n_s_m=varied(train.damping_n_s_m, WORN_SHARE, rng),
        ),
        "backlash": play._replace(play_m=varied(play.play_m, WORN_SHARE, rng)),
    }
    inertia_kg_cm2 = varied(axis.motor.inertia_kg_cm2, MASS_SHARE, rng)
    motor = axis.motor.model_copy(update={"inertia_kg_cm2": inertia_kg_cm2})
    return axis.model_copy(update={"effects": effects, "motor": motor})


def measured(machine: MachineConfig, table: RandomTable) -> dict[str, float]:
    """Return the figures of one law on one table; a step that does not settle has the hold as its time.

    `rest_um` is the largest |deviation| by the scale at the end of any hold.
    """
    found: dict[str, float] = {}
    rest_um = []
    for name, size_m in (("step", STEP_M), ("own_step", table.step_m)):
        command_m, scale_m = _run(machine, table, _step_up_and_down(machine, size_m))
        figures = step_figures(command_m, scale_m, machine.period_s)
        settling_ms = figures.settling_s * 1e3
        found[f"{name}_overshoot_pct"] = figures.overshoot_pct
        found[f"{name}_settling_ms"] = HOLD_S * 1e3 if math.isnan(settling_ms) else settling_ms
        rest_um.append(_deviation_at_rest_um(command_m - scale_m, machine.period_s))
    command_m, scale_m = _run(machine, table, [_sine(machine)])
    sine = sine_figures(command_m, scale_m, machine.period_s)
    found |= {
        "sine_rms_um": sine.rms_um,
        "sine_peak_um": sine.peak_um,
        "dead_time_ms": sine.dead_time_s * 1e3,
        "rest_um": max(rest_um),
    }
    return found


def _run(machine: MachineConfig, table: RandomTable, steps: list[Step]) -> tuple[Any, Any]:
    axis = twin_axis(machine, table.plant, AXIS, axis_params(machine, AXIS))
    rows = axis.rollout.rows(motion(machine, AXIS, steps))[REST_CYCLES - 1 :]
    return rows["position_command_m"], rows["scale_position_m"]


def _deviation_at_rest_um(error_m: Any, period_s: float) -> float:
    """Return the largest |error| at the end of both holds, the first half and the second."""
    rest, half = round(REST_S / period_s), len(error_m) // 2
    ends = np.concatenate((error_m[half - rest : half], error_m[-rest:]))
    return float(np.abs(ends).max()) * 1e6


def _step_up_and_down(machine: MachineConfig, size_m: float) -> list[Step]:
    feed_m_s = machine.axes[AXIS].limits.velocity_mm_s * 1e-3

    def to(position_m: float) -> Move:
        target = tuple(position_m if name == AXIS else math.nan for name in machine.axes)
        return Move("step", target, feed_m_s, math.inf, trapezoidal=True)

    return [to(size_m), Dwell("held", HOLD_S), to(0.0), Dwell("held", HOLD_S)]


def _sine(machine: MachineConfig) -> Sine:
    amplitude_m, frequency_hz, cycles = SINE
    index = list(machine.axes).index(AXIS)
    return Sine("sine", index, amplitude_m, 2.0 * math.pi * frequency_hz, cycles, ramp_s=0.125 / frequency_hz)


def main() -> None:
    """Measure both laws on every table; write JSON."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--tables", type=int, default=20)
    parser.add_argument("--json", type=Path, required=True)
    options = parser.parse_args()
    laws = {law: load_machine(MACHINE / file) for law, file in CONTROLLERS.items()}
    rows = [
        {"step_mm": table.step_m * 1e3, **{law: measured(machine, table) for law, machine in laws.items()}}
        for table in random_tables(load_plant(MACHINE), options.tables, SEED)
    ]
    write_figures(options.json, {"made": "batch twin", "seed": SEED, "aim_um": AIM_UM, "tables": rows})


if __name__ == "__main__":
    main()
