"""`servo-ctrl learned`: learned pulses and screws on the disk, without a bus."""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.console import Console
from rich.table import Table

from servo_ctrl.cli.learned_report import description, tables_of
from servo_ctrl.cli.options import (  # noqa: TC001  # typer reads the annotations at run time
    LearnedOption,
    MachineOption,
)
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.telemetry.learned_plots import LearnedAxis, plot_learned
from servo_ctrl.telemetry.learned_store import LearnedStore, ScrewStore, StoreError, default_directory
from servo_ctrl.telemetry.screw_plots import ScrewAxis, plot_screws

if TYPE_CHECKING:
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.telemetry.learned_store import VersionEntry

    Store = LearnedStore | ScrewStore

app = typer.Typer(no_args_is_help=True)

AxesOption = Annotated[
    list[str] | None, typer.Option("--axis", help="Axis; may be repeated. Without it, all axes.")
]
AxisOption = Annotated[str, typer.Option("--axis", help="Axis.", show_default=False)]


class Kind(StrEnum):
    """What was learned."""

    PULSE = "pulse"
    SCREW = "screw"


KindOption = Annotated[Kind, typer.Option("--kind", help="Friction pulse, or screw error and lost motion.")]
WITHOUT = {Kind.PULSE: "a learned pulse", Kind.SCREW: "its learned screw"}


@app.callback()
def results() -> None:
    """See, draw and roll back what a machine has learned, without a bus: friction pulses, and its screws.

    A running controller has read it at the start: ask it to roll back instead (docs/learning.md).
    """


@app.command("list")
def list_versions(machine: MachineOption, learned: LearnedOption = None, axes: AxesOption = None) -> None:
    """List the versions of each axis: date, learner, strokes, J before and after, which one is in use.

    Pulses and screws (learner "screw") are numbered on their own.

    Example:  servo-ctrl learned list --machine machines/xy_table
    """
    config = load_machine(machine)
    table = Table(
        title=f"learned by {config.machine.name}",
        title_justify="left",
        caption=f"{learned or default_directory(config)}",
        caption_justify="left",
        box=None,
        padding=(0, 2, 0, 0),
    )
    for heading in ("axis", "no.", "in use", "sound", "learned at", "learner", "strokes", "J um"):
        justify: Literal["left", "right"] = "right" if heading in {"no.", "strokes"} else "left"
        table.add_column(heading, justify=justify, no_wrap=True)
    problems = []
    for axis in axes or config.axes:
        for kind in Kind:
            store = _store(config, learned, kind)
            entries = store.versions(axis)
            if not entries and not _fitted(config, axis, kind):
                continue
            for entry in entries:
                table.add_row(axis, *_cells(entry))
                if entry.problem:
                    problems.append(f"axis {axis}, version {entry.version}: {entry.problem}")
            problems += _not_used(store, axis, kind)
    Console(markup=False, highlight=False).print(table)
    for problem in problems:
        typer.echo(problem)


def _fitted(config: MachineConfig, axis: str, kind: Kind) -> bool:
    """The machine file has the section."""
    section = config.axes[axis]
    wanted = section.friction_compensation if kind is Kind.PULSE else section.screw_compensation
    return wanted is not None


def _not_used(store: Store, axis: str, kind: Kind) -> list[str]:
    try:
        if store.active(axis) is None:
            of = " of the screw" if kind is Kind.SCREW else ""
            return [f"axis {axis}: no version{of} is in use"]
    except StoreError as error:
        return [f"axis {axis} runs without {WITHOUT[kind]}: {error}"]
    return []


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
    kind: KindOption = Kind.PULSE,
) -> None:
    """Show one version in full: functions or table, where they come from and what they depend on.

    Example:  servo-ctrl learned show --machine machines/xy_table --axis x --version 2
    """
    store = _store(load_machine(machine), learned, kind)
    entry = _entry(store, axis, version)
    if entry.result is None:
        raise StoreError(f"axis {axis}, version {entry.version}: {entry.problem}")
    if as_json:
        typer.echo(json.dumps(entry.result.model_dump(mode="json"), indent=2))
        return
    console = Console(markup=False, highlight=False)
    for line in description(entry, entry.result):
        console.print(line)
    for table in tables_of(entry.result.learned.learned()):
        console.print(table)


def _entry(store: Store, axis: str, version: int | None) -> VersionEntry:
    entries = store.versions(axis)
    found = [entry for entry in entries if (entry.in_use if version is None else entry.version == version)]
    if found:
        return found[0]
    known = ", ".join(str(entry.version) for entry in entries) or "none"
    wanted = "no version is in use" if version is None else f"there is no version {version}"
    raise StoreError(f"{store.directory}: axis {axis}: {wanted}; versions: {known}")


@app.command()
def rollback(
    machine: MachineOption, axis: AxisOption, learned: LearnedOption = None, kind: KindOption = Kind.PULSE
) -> None:
    """Take the version before the one in use into use again; nothing is deleted.

    The next start of the controller runs with it. Before the first version is none: the axis then runs
    without a learned pulse, or screw.

    Example:  servo-ctrl learned rollback --machine machines/xy_table --axis x
    """
    store = _store(load_machine(machine), learned, kind)
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
    kind: KindOption = Kind.PULSE,
) -> None:
    """Draw what is in use: the pulse over the reverse acceleration, or the screw over the travel.

    Example:  servo-ctrl learned plot --machine machines/xy_table --out learned.png
    """
    config = load_machine(machine)
    directory, names = learned or default_directory(config), axes or list(config.axes)
    if kind is Kind.SCREW:
        drawn = _draw_screws(config, ScrewStore(directory, config), names, out)
    else:
        drawn = _draw_pulses(config, LearnedStore(directory, config), names, out)
    if not drawn:
        raise StoreError(f"{directory}: no version is in use, there is nothing to draw")
    typer.echo(f"picture: {out}")


def _draw_pulses(config: MachineConfig, store: LearnedStore, axes: list[str], out: Path) -> bool:
    drawn = []
    for axis in axes:
        if (result := store.active(axis)) is not None:
            label = f"{axis}, version {result.version} ({result.learned.learner})"
            limit_m_s = axis_params(config, axis).pulse.amplitude_max_m_s
            drawn.append(LearnedAxis(label, result.learned, limit_m_s))
    if drawn:
        plot_learned(out, drawn, f"{config.machine.name}: learned friction compensation")
    return bool(drawn)


def _draw_screws(config: MachineConfig, store: ScrewStore, axes: list[str], out: Path) -> bool:
    found = [(axis, store.active(axis)) for axis in axes]
    drawn = [
        ScrewAxis(f"{axis}, version {result.version}", result.learned)
        for axis, result in found
        if result is not None
    ]
    if drawn:
        plot_screws(out, drawn, f"{config.machine.name}: learned screws")
    return bool(drawn)


def _store(config: MachineConfig, directory: Path | None, kind: Kind) -> Store:
    opened = ScrewStore if kind is Kind.SCREW else LearnedStore
    return opened(directory or default_directory(config), config)
