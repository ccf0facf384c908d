"""`servo-ctrl learned`: stored pulses, waveforms and screws, without a bus."""

from pathlib import Path
from typing import Annotated

import typer

from servo_ctrl.cli.options import LearnedKind, LearnedKindOption, LearnedOption, MachineOption
from shipped_files.plain_help import PlainCommand, PlainGroup

app = typer.Typer(cls=PlainGroup, no_args_is_help=True)

AxesOption = Annotated[
    list[str] | None, typer.Option("--axis", help="Axis; may be repeated. Without it, all axes.")
]
AxisOption = Annotated[str, typer.Option("--axis", help="Axis.", show_default=False)]


@app.callback()
def results() -> None:
    """See, draw and roll back what a machine has learned, without a bus: friction pulses, waveforms, screws.

    A running controller has read the results at its start: use `servo-ctrl ask` instead (docs/learning.md).
    """


@app.command("list")
def list_versions(machine: MachineOption, learned: LearnedOption = None, axes: AxesOption = None) -> None:
    """List the versions of each axis: date, learner, strokes, J before and after, which one is in use.

    Pulses, screws (learner "screw") and waveforms have numbers of their own.

    Example:  servo-ctrl learned list --machine machines/xy_table
    """
    from servo_ctrl.cli.learned_report import print_versions

    print_versions(machine, learned, axes)


@app.command(cls=PlainCommand)
def show(
    machine: MachineOption,
    axis: AxisOption,
    learned: LearnedOption = None,
    version: Annotated[int | None, typer.Option(min=1, help="Version. Without it, the one in use.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="As JSON, in SI units, as it is stored.")] = False,
    kind: LearnedKindOption = LearnedKind.PULSE,
) -> None:
    """Show one version in full: functions or table, their origin, and what they depend on.

    Example:  servo-ctrl learned show --machine machines/xy_table --axis x --version 2
    """
    from servo_ctrl.cli.learned_report import open_store, print_version

    print_version(open_store(machine, learned, kind), axis, version, as_json=as_json)


@app.command(cls=PlainCommand)
def rollback(
    machine: MachineOption,
    axis: AxisOption,
    learned: LearnedOption = None,
    kind: LearnedKindOption = LearnedKind.PULSE,
) -> None:
    """Put the version before the one in use into use; nothing is deleted.

    The controller uses it from its next start on. Before the first version there is none: the axis then runs
    without a learned pulse, waveform or screw.

    Example:  servo-ctrl learned rollback --machine machines/xy_table --axis x
    """
    from servo_ctrl.cli.learned_report import open_store

    result = open_store(machine, learned, kind).roll_back(axis)
    if result is None:
        typer.echo(f"axis {axis}: no version is in use")
    else:
        typer.echo(f"axis {axis}: version {result.version} of {result.learned_at} is in use")


@app.command(cls=PlainCommand)
def plot(
    machine: MachineOption,
    learned: LearnedOption = None,
    axes: AxesOption = None,
    out: Annotated[Path, typer.Option(help="PNG file to write.")] = Path("out/learned.png"),
    kind: LearnedKindOption = LearnedKind.PULSE,
) -> None:
    """Draw what is in use: pulse or waveforms by reverse acceleration, or the screw over the travel.

    Example:  servo-ctrl learned plot --machine machines/xy_table --out learned.png
    """
    from servo_ctrl.cli.learned_report import plot_in_use

    plot_in_use(machine, learned, axes, out, kind)
    typer.echo(f"picture: {out}")
