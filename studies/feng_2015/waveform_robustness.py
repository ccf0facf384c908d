"""Measures the learned waveforms on motions and tables that were used for no choice.

    python -m studies.feng_2015.waveform_robustness --tables 20 --json docs/friction_waveforms.json

Each machine and table of `waveform_conditions` learns by itself, and is measured on the motions of the
study, on circles of other radii, and on `held_out_motions`, all in the batch twin.
"""

import argparse
from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.learning.reversal_waveform import WaveformLearned
from servo_ctrl.metrology.circles import ReversalFigures
from studies.feng_2015.held_out_motions import held_out_motions, motion_figures
from studies.feng_2015.rivals import rival_figures
from studies.feng_2015.twin_motions import twin_figures, twin_program
from studies.feng_2015.variants import study_program
from studies.feng_2015.waveform_conditions import Condition, named_conditions, random_tables
from studies.feng_2015.waveform_learning import learn_waveforms, with_learned
from twin.plant_file import load_plant

MACHINE = Path(__file__).parents[2] / "machines" / "xy_table"
UNSEEN = ((10.0, 1500.0), (15.0, 750.0), (40.0, 2500.0), (30.0, 3000.0))
"""Radius (mm) and feed (mm/min) of further circles; chosen before any was run with waveforms."""
SEED = 24
"""Seed of the random tables; chosen."""
DECIMALS = 4
"""Of micrometres, per cent, and settings in the JSON; chosen."""
Figures = dict[tuple[str, str], ReversalFigures]
"""(Axis or "S", label) to the four indicators, micrometres."""


class MeasuredTable(NamedTuple):
    """The figures of all motions on one table, and the learning strokes of each axis."""

    without: Figures
    learned: Figures
    stale: Figures
    """With the waveforms of the unchanged table, without new strokes; empty where this was not measured."""
    strokes: dict[str, int]


def held_out_program(machine: Path) -> ProgramConfig:
    """Return the motions of the study and the further circles as one program."""
    program = study_program(machine)
    steps: list[Any] = []
    for radius_mm, feed_mm_min in UNSEEN:
        steps.append(
            {
                "kind": "move",
                "label": f"to R {radius_mm:g}",
                "to_mm": {"x": radius_mm, "y": 0.0},
                "feed_mm_min": 6000.0,
            }
        )
        label = f"R {radius_mm:g} F {feed_mm_min:g}"
        circle = {"kind": "circle", "label": label, "radius_mm": radius_mm, "feed_mm_min": feed_mm_min}
        steps.append({**circle, "turns": 1.6, "ramp_s": 0.5})
    home = {"kind": "move", "label": "home", "to_mm": {"x": 0.0, "y": 0.0}, "feed_mm_min": 6000.0}
    return ProgramConfig.model_validate({"source": program.source, "step": [*steps, home, *program.steps]})


def measured(condition: Condition, stale: dict[str, WaveformLearned] | None) -> MeasuredTable:
    """Learn on sines, and measure on the motions."""
    machine, plant = condition.machine, condition.plant
    learned_here = learned_of(condition)
    params = {axis: axis_params(machine, axis) for axis in machine.axes}
    program, held_out = (
        twin_program(machine, held_out_program(machine.source.parent)),
        held_out_motions(machine),
    )

    def figures(learned: dict[str, WaveformLearned] | None) -> Figures:
        acting = params
        if learned is not None:
            acting = {axis: with_learned(plain, learned[axis]) for axis, plain in params.items()}
        found = twin_figures(machine, plant, program, acting)
        for motion in held_out:
            found |= motion_figures(machine, plant, motion, acting)
        return found

    return MeasuredTable(
        figures(None),
        figures(learned_here),
        {} if stale is None else figures(stale),
        {axis: entry.strokes for axis, entry in learned_here.items()},
    )


def learned_of(condition: Condition) -> dict[str, WaveformLearned]:
    """Learn the waveforms of all axes of a machine."""
    machine, plant = condition.machine, condition.plant
    with ThreadPoolExecutor() as threads:
        found = threads.map(lambda axis: learn_waveforms(machine, plant, axis).learned, machine.axes)
    return dict(zip(machine.axes, found, strict=True))


def entries(table: MeasuredTable) -> list[dict[str, Any]]:
    """Return one row per motion, for JSON: micrometres and per cent."""
    rows = []
    for (axis, label), without in table.without.items():
        learned, stale = table.learned[axis, label], table.stale.get((axis, label))
        row: dict[str, Any] = {
            "axis": axis,
            "label": label,
            "WTFC": without._asdict(),
            "LWC": learned._asdict(),
        }
        row["least_reduction_percent"] = _least_percent(without, learned)
        if stale is not None:
            row["stale_least_reduction_percent"] = _least_percent(without, stale)
        rows.append(row)
    return rows


def _least_percent(without: ReversalFigures, learned: ReversalFigures) -> float:
    return min(100.0 * (1.0 - b / a) for a, b in zip(without, learned, strict=True))


def rounded(figures: Any) -> Any:
    """Return figures for JSON with as many decimals as mean something: half the file."""
    if isinstance(figures, dict):
        return {key: rounded(value) for key, value in figures.items()}
    if isinstance(figures, list | tuple):
        return [rounded(value) for value in figures]
    return round(figures, DECIMALS) if isinstance(figures, float) else figures


def main() -> None:
    """Measure every condition and the random tables; write JSON after each."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--tables", type=int, default=20)
    parser.add_argument("--json", type=Path, required=True)
    options = parser.parse_args()
    machine, plant = load_machine(MACHINE), load_plant(MACHINE)
    named = list(named_conditions(machine, plant))
    nominal = learned_of(named[0])
    study = twin_program(machine, study_program(MACHINE))
    rivals = rival_figures(machine, plant, study, nominal)
    figures: dict[str, Any] = {"seed": SEED, "made": "batch twin", "rivals": rivals}
    figures |= {"tables": [], "conditions": []}
    for condition in chain(named, random_tables(machine, plant, options.tables, SEED)):
        drawn = condition.name.startswith("table")
        fits = condition.machine is machine and condition.plant is not plant
        result = measured(condition, nominal if fits and not drawn else None)
        rows = entries(result)
        entry = {"name": condition.name, "strokes": result.strokes, "motions": rows}
        figures["tables" if drawn else "conditions"].append(entry)
        least = min(row["least_reduction_percent"] for row in rows)
        peak_um = max(row["LWC"]["contour_peak_um"] for row in rows)
        print(  # noqa: T201  # progress of a command
            f"{condition.name}: least reduction {least:.1f} %, largest contour error {peak_um:.2f} um",
            flush=True,
        )
        write_figures(options.json, rounded(figures))


if __name__ == "__main__":
    main()
