"""`servo-ctrl learned`: the learned functions on the disk, without a bus."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.console import Console
from rich.table import Table

from servo_ctrl.cli.options import (  # noqa: TC001  # typer reads the annotations at run time
    LearnedOption,
    MachineOption,
)
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.telemetry.learned_plots import LearnedAxis, plot_learned
from servo_ctrl.telemetry.learned_store import LearnedStore, StoreError, default_directory

if TYPE_CHECKING:
    from servo_ctrl.config.learned_model import ResultFile
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.learning.types import Learned
    from servo_ctrl.telemetry.learned_store import VersionEntry

app = typer.Typer(no_args_is_help=True)

AxesOption = Annotated[
    list[str] | None, typer.Option("--axis", help="Axis; may be repeated. Without it, all axes.")
]
AxisOption = Annotated[str, typer.Option("--axis", help="Axis.", show_default=False)]


@app.callback()
def results() -> None:
    """See, draw and roll back the learned friction compensation of a machine, without a bus.

    A running controller has read its functions at the start: ask it to roll back instead (docs/learning.md).
    """


@app.command("list")
def list_versions(machine: MachineOption, learned: LearnedOption = None, axes: AxesOption = None) -> None:
    """List the versions of each axis: date, learner, strokes, J before and after, which one is in use.

    Example:  servo-ctrl learned list --machine machines/xy_table
    """
    config, store = _opened(machine, learned)
    table = Table(
        title=f"learned functions of {config.machine.name}",
        title_justify="left",
        caption=f"{store.directory}",
        caption_justify="left",
        box=None,
        padding=(0, 2, 0, 0),
    )
    for heading in ("axis", "no.", "in use", "sound", "learned at", "learner", "strokes", "J um"):
        justify: Literal["left", "right"] = "right" if heading in {"no.", "strokes"} else "left"
        table.add_column(heading, justify=justify, no_wrap=True)
    problems = []
    for axis in axes or config.axes:
        for entry in store.versions(axis):
            table.add_row(axis, *_cells(entry))
            if entry.problem:
                problems.append(f"axis {axis}, version {entry.version}: {entry.problem}")
        try:
            if store.active(axis) is None:
                problems.append(f"axis {axis}: no version is in use")
        except StoreError as error:
            problems.append(f"axis {axis} runs without a learned pulse: {error}")
    Console(markup=False, highlight=False).print(table)
    for problem in problems:
        typer.echo(problem)


def _cells(entry: VersionEntry) -> list[str]:
    state = [f"{entry.version}", "yes" if entry.in_use else "no", "no" if entry.problem else "yes"]
    if entry.result is None:
        return state
    functions = entry.result.learned
    return [
        *state,
        entry.result.learned_at,
        functions.learner,
        f"{functions.strokes}",
        f"{functions.before_m * 1e6:.2f} -> {functions.after_m * 1e6:.2f}",
    ]


@app.command()
def show(
    machine: MachineOption,
    axis: AxisOption,
    learned: LearnedOption = None,
    version: Annotated[int | None, typer.Option(min=1, help="Version. Without it, the one in use.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="As JSON, in SI units, as it is stored.")] = False,
) -> None:
    """Show one version in full: the functions, where they come from and what they depend on.

    Example:  servo-ctrl learned show --machine machines/xy_table --axis x --version 2
    """
    _, store = _opened(machine, learned)
    entry = _entry(store, axis, version)
    if entry.result is None:
        raise StoreError(f"axis {axis}, version {entry.version}: {entry.problem}")
    if as_json:
        typer.echo(json.dumps(entry.result.model_dump(mode="json"), indent=2))
        return
    console = Console(markup=False, highlight=False)
    for line in _description(entry, entry.result):
        console.print(line)
    for table in _functions(entry.result.learned.learned()):
        console.print(table)


def _entry(store: LearnedStore, axis: str, version: int | None) -> VersionEntry:
    entries = store.versions(axis)
    found = [entry for entry in entries if (entry.in_use if version is None else entry.version == version)]
    if found:
        return found[0]
    known = ", ".join(str(entry.version) for entry in entries) or "none"
    wanted = "no version is in use" if version is None else f"there is no version {version}"
    raise StoreError(f"{store.directory}: axis {axis}: {wanted}; versions: {known}")


def _description(entry: VersionEntry, result: ResultFile) -> list[str]:
    functions = result.learned
    between = (
        f"GRNN with spread {functions.spread_m_s2 * 1e3:.4g} mm/s^2" if functions.spread_m_s2 else "lines"
    )
    return [
        f"axis {result.axis} of {result.machine}, version {result.version}"
        + (", in use" if entry.in_use else ""),
        *([f"cannot be used: {entry.problem}"] if entry.problem else []),
        f"learned at {result.learned_at} by servo-ctrl {result.software}, learner {functions.learner}",
        f"{functions.strokes} strokes, {functions.machine_time_s / 60.0:.1f} min of machine time",
        f"J {functions.before_m * 1e6:.2f} um before, {functions.after_m * 1e6:.2f} um after",
        "depends on:",
        *(f"  {key} = {value}" for key, value in result.basis.items()),
        "conditions:",
        *(f"  {key} = {value}" for key, value in result.conditions.items()),
        f"amplitude between the points: {between}",
    ]


def _functions(learned: Learned) -> list[Table]:
    tables = []
    for title, headings, points in (
        ("duration", ("T* ms",), learned.durations),
        ("amplitude", ("A* mm/s",), learned.amplitudes),
        ("second trapezoid", ("start ms", "duration ms", "amplitude mm/s"), learned.trailing),
    ):
        table = Table(title=title, title_justify="left")
        for heading in ("a mm/s^2", *headings):
            table.add_column(heading, justify="right")
        for point in points:
            table.add_row(*(f"{value * 1e3:.4g}" for value in point))
        tables += [table] if points else []
    return tables


@app.command()
def rollback(machine: MachineOption, axis: AxisOption, learned: LearnedOption = None) -> None:
    """Take the version before the one in use into use again; nothing is deleted.

    The next start of the controller runs with it. Before the first version is none: the axis then runs
    without a learned pulse.

    Example:  servo-ctrl learned rollback --machine machines/xy_table --axis x
    """
    _, store = _opened(machine, learned)
    result = store.roll_back(axis)
    if result is None:
        typer.echo(f"axis {axis}: no version is in use")
    else:
        typer.echo(f"axis {axis}: version {result.version} of {result.learned_at} is in use")


@app.command()
def plot(
    machine: MachineOption,
    learned: LearnedOption = None,
    axes: AxesOption = None,
    out: Annotated[Path, typer.Option(help="PNG file to write.")] = Path("out/learned.png"),
) -> None:
    """Draw duration and amplitude of the pulses in use over the reverse acceleration, with learned points.

    Example:  servo-ctrl learned plot --machine machines/xy_table --out learned.png
    """
    config, store = _opened(machine, learned)
    drawn = []
    for axis in axes or config.axes:
        if (result := store.active(axis)) is not None:
            label = f"{axis}, version {result.version} ({result.learned.learner})"
            limit_m_s = axis_params(config, axis).pulse.amplitude_max_m_s
            drawn.append(LearnedAxis(label, result.learned, limit_m_s))
    if not drawn:
        raise StoreError(f"{store.directory}: no version is in use, there is nothing to draw")
    plot_learned(out, drawn, f"{config.machine.name}: learned friction compensation")
    typer.echo(f"picture: {out}")


def _opened(machine: Path, directory: Path | None) -> tuple[MachineConfig, LearnedStore]:
    config = load_machine(machine)
    return config, LearnedStore(directory or default_directory(config), config)
