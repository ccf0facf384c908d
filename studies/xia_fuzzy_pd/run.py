"""`servo-ctrl experiment fuzzy`: PID against fuzzy-PD on a table with friction and backlash."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.cli.progress import progress_bar
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.learning.performance import reversals
from studies.xia_fuzzy_pd.plots import (
    MotionTrace,
    plot_sines,
    plot_steps,
    plot_surface,
    plot_velocity_step,
)
from studies.xia_fuzzy_pd.study import (
    AXIS,
    CONTROLLERS,
    OPEN_LOOP,
    VELOCITY,
    LawResult,
    Trace,
    missed,
    run_law,
    run_velocity_step,
    study_figures,
)
from studies.xia_fuzzy_pd.table_forces import table_forces

NAMES = {"pid": "PID", "fuzzy_pd": "fuzzy-PD"}
STEP_SHOWN_S, REVERSAL_SHOWN_S, VELOCITY_BEFORE_S, VELOCITY_SHOWN_S = 0.2, 0.1, 0.01, 0.1


def run_fuzzy(machine: Path, out: Path, json_file: Path | None) -> None:
    """Run a velocity step, position steps and a sine (Xia et al., figures 6-8) with PID and with fuzzy-PD."""
    console = Console()
    results = {}
    for law, name in NAMES.items():
        console.print(f"position step and sine over the bus: {name} ...")
        with progress_bar() as show:
            results[law] = asyncio.run(run_law(machine, law, out, show))
    console.print("velocity step over the bus ...")
    with progress_bar() as show:
        velocity = asyncio.run(run_velocity_step(machine, out, show))
    console.print(_table(results))
    for sentence in missed(results):
        console.print(sentence, style="bold red", highlight=False)
    for picture in _draw(machine, out, results, velocity):
        console.print(f"picture: {picture}", highlight=False)
    write_figures(json_file, study_figures(results))


def _table(results: dict[str, LawResult]) -> Table:
    table = Table(title="Position laws on the table with friction and backlash")
    table.add_column("figure")
    for law in results:
        table.add_column(NAMES[law], justify="right")
    rows: dict[str, list[str]] = {
        "step: overshoot": [f"{result.step.overshoot_pct:.2f} %" for result in results.values()],
        "step: settling within 2 %": [
            f"{result.step.settling_s * 1e3:.0f} ms" for result in results.values()
        ],
        "sine: RMS error": [f"{result.sine.rms_um:.1f} um" for result in results.values()],
        "sine: peak error": [f"{result.sine.peak_um:.1f} um" for result in results.values()],
        "sine: dead time at the reversal": [
            f"{result.sine.dead_time_s * 1e3:.1f} ms" for result in results.values()
        ],
    }
    for name, cells in rows.items():
        table.add_row(name, *cells)
    return table


def _draw(machine: Path, out: Path, results: dict[str, LawResult], velocity: Trace) -> Iterator[Path]:
    surface = axis_params(load_machine(machine / CONTROLLERS["fuzzy_pd"]), AXIS).fuzzy.surface
    yield _drawn(out / "surface.png", plot_surface, surface)
    yield _draw_velocity_step(machine, out, velocity)
    steps = {NAMES[law]: _motion(result.step_trace) for law, result in results.items()}
    yield _drawn(out / "position_step.png", plot_steps, steps, STEP_SHOWN_S)
    sines = {NAMES[law]: _motion(result.sine_trace) for law, result in results.items()}
    first = next(iter(sines.values()))
    turns = reversals(first.command_m)
    reversal_s = float(first.time_s[turns[len(turns) // 2]])
    yield _drawn(out / "sine.png", plot_sines, sines, reversal_s, REVERSAL_SHOWN_S)


def _draw_velocity_step(machine: Path, out: Path, seen: Trace) -> Path:
    """Forces are the twin's, velocities those of the bus."""
    config = load_machine(machine / OPEN_LOOP)
    forces = table_forces(machine / OPEN_LOOP, machine, machine / VELOCITY)
    begin = int(np.argmax(seen.command_m_s != 0.0))
    shown = slice(
        begin - round(VELOCITY_BEFORE_S / config.period_s), begin + round(VELOCITY_SHOWN_S / config.period_s)
    )
    return _drawn(
        out / "velocity_step.png",
        plot_velocity_step,
        seen.time_s[shown] - seen.time_s[begin],
        {"driving force, screw to table": forces.transmitted_n[shown], "friction": forces.friction_n[shown]},
        {
            "table, by the scale": np.gradient(seen.scale_m, config.period_s)[shown],
            "motor, by its encoder": np.gradient(seen.motor_m, config.period_s)[shown],
            "command": seen.command_m_s[shown],
        },
    )


def _motion(trace: Trace) -> MotionTrace:
    return MotionTrace(trace.time_s, trace.command_m, trace.scale_m, trace.table_m_s, trace.force_n)


def _drawn(path: Path, plot: Any, *what: Any) -> Path:
    plot(path, *what)
    return path
