"""`servo-ctrl experiment fuzzy`: PID against fuzzy-PD on a table with friction and backlash."""

import asyncio
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.markdown import Markdown

from kernels.arrays import Array
from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.cli.progress import progress_bar
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program import check_program
from servo_ctrl.learning.performance import reversals
from studies.markdown_table import markdown_table, titled
from studies.twin_axis import motion, twin_axis
from studies.xia_fuzzy_pd.plots import plot_sines, plot_steps, plot_surface, plot_velocity_step
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
from twin.plant_file import load_plant

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


def _table(results: dict[str, LawResult]) -> Markdown:
    texts = {
        "step: overshoot": lambda result: f"{result.step.overshoot_pct:.2f} %",
        "step: settling within 2 %": lambda result: f"{result.step.settling_s * 1e3:.0f} ms",
        "sine: RMS error": lambda result: f"{result.sine.rms_um:.1f} um",
        "sine: peak error": lambda result: f"{result.sine.peak_um:.1f} um",
        "sine: dead time at the reversal": lambda result: f"{result.sine.dead_time_s * 1e3:.1f} ms",
    }
    rows = [(name, *map(text, results.values())) for name, text in texts.items()]
    heads = ("figure", *(NAMES[law] for law in results))
    return titled("Position laws on the table with friction and backlash", markdown_table(heads, rows))


def _draw(machine: Path, out: Path, results: dict[str, LawResult], velocity: Trace) -> list[Path]:
    """Draw all pictures; return their files. Raises OSError."""
    pictures = [out / f"{name}.png" for name in ("surface", "velocity_step", "position_step", "sine")]
    surface, velocity_step, position_step, sine = pictures
    plot_surface(surface, axis_params(load_machine(machine / CONTROLLERS["fuzzy_pd"]), AXIS).fuzzy.surface)
    _draw_velocity_step(velocity_step, machine, velocity)
    steps = {NAMES[law]: result.step_trace for law, result in results.items()}
    plot_steps(position_step, steps, STEP_SHOWN_S)
    sines = {NAMES[law]: result.sine_trace for law, result in results.items()}
    first = next(iter(sines.values()))
    turns = reversals(first.command_m)
    plot_sines(sine, sines, float(first.time_s[turns[len(turns) // 2]]), REVERSAL_SHOWN_S)
    return pictures


def _draw_velocity_step(path: Path, machine: Path, trace: Trace) -> None:
    """Draw forces from the twin and velocities from the run on the bus."""
    period_s = load_machine(machine / OPEN_LOOP).period_s
    forces = table_forces(machine / OPEN_LOOP, machine, machine / VELOCITY)
    begin = int(np.argmax(trace.command_m_s != 0.0))
    shown = slice(begin - round(VELOCITY_BEFORE_S / period_s), begin + round(VELOCITY_SHOWN_S / period_s))
    plot_velocity_step(
        path,
        trace.time_s[shown] - trace.time_s[begin],
        {"driving force, screw to table": forces.transmitted_n[shown], "friction": forces.friction_n[shown]},
        {
            "table, by the scale": np.gradient(trace.scale_m, period_s)[shown],
            "motor, by its encoder": np.gradient(trace.motor_m, period_s)[shown],
            "command": trace.command_m_s[shown],
        },
    )


class TableForces(NamedTuple):
    """Forces on the table of the first axis, (n,) at the SYNC period, from the start of the program.

    For pictures, from the plant of the twin: no sensor measures them, and the controller never gets them.
    """

    transmitted_n: Array
    """Force from the screw to the table."""
    friction_n: Array
    """Friction force on the table."""


def table_forces(machine_file: Path, plant_file: Path, program_file: Path) -> TableForces:
    """Run the program from standstill at power-up on the plant of the machine.

    Raises ServoCtrlError for a file that cannot be used.
    """
    machine = load_machine(machine_file)
    axis = next(iter(machine.axes))
    twin = twin_axis(machine, load_plant(plant_file), axis, axis_params(machine, axis))
    steps = check_program(load_program(program_file, machine), machine)
    forces_n = []
    for set_point in motion(machine, axis, steps, rest_cycles=0):
        twin.rollout.rows(set_point[np.newaxis])
        forces_n.append((twin.plant_state["transmitted_n"], twin.plant_state["friction_n"]))
    return TableForces(*np.array(forces_n, dtype=np.float64).T)
