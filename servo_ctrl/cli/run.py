"""`servo-ctrl run`: boot a machine on a bus, run a program, stop in order."""

from __future__ import annotations

import asyncio
import signal
from enum import StrEnum
from pathlib import Path  # noqa: TC003  # typer reads the annotation at run time
from typing import TYPE_CHECKING, Annotated

import typer

from servo_ctrl.cli.options import (  # typer reads the annotations at run time
    InputOption,
    MachineOption,
    ProgramOption,
    read_program,
)
from servo_ctrl.cli.progress import progress_bar
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.supervisor import run_machine

if TYPE_CHECKING:
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.daemon.report import RunReport


class PacingOption(StrEnum):
    """What starts a cycle."""

    REALTIME = "realtime"
    LOCKSTEP = "lockstep"


def run(
    machine: MachineOption,
    bus: Annotated[
        str,
        typer.Option(
            help="INTERFACE:CHANNEL of python-can: socketcan:can0, socketcan:vcan0, localcan:/tmp/bus.sock.",
            show_default=False,
        ),
    ],
    program: ProgramOption = None,
    inputs: InputOption = None,
    pacing: Annotated[
        PacingOption,
        typer.Option(
            help="realtime: a SYNC every period by the clock. lockstep: the next SYNC once all inputs are in "
            "(for a simulator that takes its time from SYNC)."
        ),
    ] = PacingOption.REALTIME,
    record: Annotated[
        Path | None,
        typer.Option(help="Directory for the recording (docs/recordings.md); must not hold one yet."),
    ] = None,
    fifo: Annotated[
        bool,
        typer.Option("--fifo", help="SCHED_FIFO and locked memory; needs permission (root, or limits)."),
    ] = False,
) -> None:
    """Boot a machine on a CAN bus, run a program and stop.

    Every node is identified against its EDS and configured; nothing moves when anything is wrong. Ctrl-C or
    SIGTERM brings the axes to rest in step, switches the drives off and closes the recording; a second one
    lets the drives brake. Exits with 0 after a completed program, 1 after an error or a fault, 128 + n after
    signal n.

    Example, with `hil-sim run --machine machines/xy_table --bus socketcan:vcan0` on the other side:

        servo-ctrl run --machine machines/xy_table --bus socketcan:vcan0 --pacing lockstep
        --program machines/xy_table/programs/circles.toml --record out/circles
    """
    config = load_machine(machine)
    chosen = read_program(program, config, inputs)
    with progress_bar() as show:
        report = asyncio.run(run_machine(config, chosen, bus, pacing.value, record, show, fifo=fifo))
    _conclude(config, report)


def _conclude(config: MachineConfig, report: RunReport) -> None:
    """Say how it went, one line an event, and exit accordingly."""
    for event in report.events:
        if event != report.reason:
            typer.echo(f"servo-ctrl: {event}", err=True)
    rate_1_s = report.cycles / report.wall_s if report.wall_s > 0.0 else 0.0
    summary = (
        f"{report.cycles} cycles, {report.cycles * config.period_s:.2f} s of machine time in "
        f"{report.wall_s:.2f} s ({rate_1_s:.0f} cycles/s)"
    )
    if report.lateness is not None:
        p50, p99, p999 = (report.lateness.percentile_us(share) for share in (0.5, 0.99, 0.999))
        summary += (
            f", ticks late by {p50:.0f}/{p99:.0f}/{p999:.0f} us (p50/p99/p99.9), {report.missed_ticks} missed"
        )
    typer.echo(f"{report.machine}: {summary}")
    if report.recording is not None:
        typer.echo(f"recording: {report.recording}")
    if report.failed:
        typer.echo(f"servo-ctrl: {report.reason}", err=True)
        raise typer.Exit(1)
    if report.signal:
        typer.echo(f"servo-ctrl: {report.reason}", err=True)
        raise typer.Exit(128 + signal.Signals[report.signal].value)
