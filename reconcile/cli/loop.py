"""`reconcile loop`: record, diagnose, move, record again, until it is decided."""

from pathlib import Path
from typing import Annotated

import typer

from reconcile.cli.options import NominalModelOption
from servo_ctrl.cli.options import PacingChoice

MachineOption = Annotated[Path, typer.Option(help="Machine directory with controller.toml, or that file.")]
OutOption = Annotated[Path, typer.Option(help="New directory: the rounds, loop.json.")]
MostRecordingsOption = Annotated[
    int, typer.Option("--max-recordings", min=1, max=100, help="Budget, the first one included.")
]
ProgramOption = Annotated[
    Path | None, typer.Option(help="First motion (a program file); without it a bit of each.")
]
PlantOption = Annotated[
    Path | None, typer.Option(help="plant.toml that is simulated; without it the machine's own.")
]
BusOption = Annotated[
    str | None,
    typer.Option(help="INTERFACE:CHANNEL where the machine is; without it a simulator is started."),
]
PacingOption = Annotated[PacingChoice, typer.Option(help="lockstep: a simulator; realtime: a machine.")]


def loop(
    machine: MachineOption,
    model: NominalModelOption,
    out: OutOption = Path("out/loop"),
    most_recordings: MostRecordingsOption = 6,
    program: ProgramOption = None,
    plant: PlantOption = None,
    bus: BusOption = None,
    pacing: PacingOption = PacingChoice.LOCKSTEP,
) -> None:
    """Move the machine, record it, find what its model lacks, and move it again until that is decided.

    Each round's motion is the one that is expected to separate the remaining explanations best, within the
    limits of controller.toml (and with a margin); the daemon checks it again before it moves. Axes must be
    referenced (homing_method). Decided means: no motion within the limits would separate them further.

        reconcile loop --machine machines/xy_table --model nominal.toml --plant worn.toml --out out/loop

    starts hil-sim with worn.toml on a bus of its own. On a machine: --bus socketcan:can0 --pacing realtime.

    Each round is in out/loop/round_N: the recording, verdict.json, model.toml, report.html and the program of
    the next one; loop.json lists all of them.

    Exit codes: 0 decided, or the budget used; 1 a file cannot be used or the machine did not run, and
    standard error says which, where and why; 2 wrong use of the command; 130 stopped by Ctrl-C: the axes
    were brought to rest, and loop.json lists the rounds until then.
    """
    from rich.console import Console

    from reconcile.loop.loop import STOPPED, LoopOptions, run_loop
    from reconcile.report.console import show
    from servo_ctrl.cli.progress import progress_bar

    options = LoopOptions(
        machine=machine,
        model=model,
        out=out,
        most_recordings=most_recordings,
        plant=plant,
        bus=bus,
        program=program,
        pacing=pacing.value,
    )
    with progress_bar() as on_progress:
        done = run_loop(
            options,
            lambda text: Console(stderr=True).print(text, highlight=False, markup=False, soft_wrap=True),
            on_progress,
        )
    if done.last is not None:
        show(done.last.verdict, Console())
    count = len(done.rounds)
    typer.echo(f"\n{done.why} after {count} recording{'s' if count > 1 else ''}: {done.log}")
    if done.why == STOPPED:
        raise typer.Exit(130)
