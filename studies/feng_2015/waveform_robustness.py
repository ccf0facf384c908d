"""How the learned waveforms fare on motions and tables that nothing was chosen on.

    python -m studies.feng_2015.waveform_robustness --tables 20 --json docs/friction_waveforms.json

Random tables differ from `machines/xy_table` in mass and in every parameter of friction, drawn independently;
the controller's gains and its feedforward mass stay. Each learns anew, and is judged on circles of other
radii and on the study's motions, all in the batch twin.
"""

import argparse
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import PlantConfig
from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.metrology.circles import ReversalFigures
from studies.feng_2015.twin_motions import TwinProgram, twin_figures, twin_program
from studies.feng_2015.variants import study_program
from studies.feng_2015.waveform_learning import learn_waveforms, with_learned
from twin.plant_file import load_plant

MACHINE = Path(__file__).parents[2] / "machines" / "xy_table"
UNSEEN = ((10.0, 1500.0), (15.0, 750.0), (40.0, 2500.0), (30.0, 3000.0))
"""Radius (mm) and feed (mm/min) of circles beside the study's; chosen before any was run with waveforms."""
MASS_SHARE, FRICTION_SHARE = 0.3, 0.5
"""Largest relative deviations of a drawn table; the issue's ranges."""
SEED = 24


class Judged(NamedTuple):
    """Motions of one table: (axis or "S", label) to figures without and with waveforms, and the strokes."""

    without: dict[tuple[str, str], ReversalFigures]
    learned: dict[tuple[str, str], ReversalFigures]
    strokes: dict[str, int]


def unseen_program(machine: Path) -> ProgramConfig:
    """The study's motions and the circles beside them."""
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


def judged(machine: MachineConfig, plant: PlantConfig, program: TwinProgram) -> Judged:
    """Learn on sines, and judge."""
    found = {axis: learn_waveforms(machine, plant, axis) for axis in machine.axes}
    params = {axis: axis_params(machine, axis) for axis in machine.axes}
    ours = {axis: with_learned(params[axis], entry.learned) for axis, entry in found.items()}
    learned = twin_figures(machine, plant, program, ours)
    without = twin_figures(machine, plant, program, params)
    return Judged(without, learned, {axis: entry.learned.strokes for axis, entry in found.items()})


def drawn(plant: PlantConfig, rng: np.random.Generator) -> PlantConfig:
    """Another table."""

    def share(largest: float) -> float:
        return float(1.0 + rng.uniform(-largest, largest))

    axes = {}
    for name, axis in plant.axes.items():
        effects = {
            key: effect._replace(
                **{
                    field: _scaled(value, share(FRICTION_SHARE))
                    for field, value in effect._asdict().items()
                    if field not in ("enabled", "share")
                }
            )
            if key in ("viscous_friction", "coulomb_friction", "stribeck_friction", "presliding_gms")
            else effect
            for key, effect in axis.effects.items()
        }
        table = axis.table.model_copy(update={"mass_kg": axis.table.mass_kg * share(MASS_SHARE)})
        axes[name] = axis.model_copy(update={"effects": effects, "table": table})
    return plant.model_copy(update={"axes": axes})


def _scaled(value: Any, share: float) -> Any:
    return tuple(entry * share for entry in value) if isinstance(value, tuple) else value * share


def entries(table: Judged) -> list[dict[str, Any]]:
    """One row a motion, for JSON: micrometres and per cent."""
    return [
        {
            "axis": axis,
            "label": label,
            "WTFC": without._asdict(),
            "LWC": table.learned[axis, label]._asdict(),
            "least_reduction_percent": min(
                100.0 * (1.0 - b / a) for a, b in zip(without, table.learned[axis, label], strict=True)
            ),
        }
        for (axis, label), without in table.without.items()
    ]


def markdown(figures: dict[str, Any]) -> str:
    """The table of the documents from the committed JSON: the machine itself, then the drawn ones."""
    nominal, others = figures["tables"][0]["motions"], [table["motions"] for table in figures["tables"][1:]]
    nominal_heads = (
        "| motion | without, peak um | LWC: contour peak, mean, peak, RMS um | least reduction % |"
    )
    drawn_heads = f" {len(others)} tables: peak um, median, worst | least reduction %, median, worst |"
    lines = [nominal_heads + drawn_heads, "|---|---|---|---|---|---|"]
    for place, row in enumerate(nominal):
        peaks = [table[place]["LWC"]["contour_peak_um"] for table in others]
        reductions = [table[place]["least_reduction_percent"] for table in others]
        lines.append(
            f"| {row['axis']} {row['label']} | {row['WTFC']['contour_peak_um']:.2f} | "
            f"{', '.join(f'{value:.2f}' for value in row['LWC'].values())} | "
            f"{row['least_reduction_percent']:.1f} | {np.median(peaks):.2f}, {max(peaks):.2f} | "
            f"{np.median(reductions):.1f}, {min(reductions):.1f} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """The nominal table and the drawn ones, as JSON."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--tables", type=int, default=20)
    parser.add_argument("--json", type=Path, required=True)
    options = parser.parse_args()
    machine, plant = load_machine(MACHINE), load_plant(MACHINE)
    program, rng = twin_program(machine, unseen_program(MACHINE)), np.random.default_rng(SEED)
    plants = [plant, *(drawn(plant, rng) for _ in range(options.tables))]
    tables = []
    for number, entry in enumerate(plants):
        result = judged(machine, entry, program)
        rows = entries(result)
        tables.append({"table": number, "strokes": result.strokes, "motions": rows})
        least = min(row["least_reduction_percent"] for row in rows)
        peak_um = max(row["LWC"]["contour_peak_um"] for row in rows)
        print(  # noqa: T201  # progress of a command
            f"table {number}: least reduction {least:.1f} %, largest contour error {peak_um:.2f} um",
            flush=True,
        )
        write_figures(options.json, {"seed": SEED, "made": "batch twin", "tables": tables})


if __name__ == "__main__":
    main()
