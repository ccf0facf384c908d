"""Runs of a machine from the command line: progress on standard error, then the outcome.

`run` and `learn` declare the options; here they become a run.
"""

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import typer

from servo_ctrl.cli.conclusion import conclude, print_learned
from servo_ctrl.cli.operator_page import page_at, url_of
from servo_ctrl.cli.option_values import read_program, with_broker
from servo_ctrl.cli.progress import progress_bar
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.daemon.learning.learned_compensation import Compensation
from servo_ctrl.daemon.page.page_process import PageOptions
from servo_ctrl.daemon.run.report import Pacing, RunReport
from servo_ctrl.daemon.run.run_options import LearningRequest
from servo_ctrl.daemon.run.supervisor import run_machine


class MachineRun(NamedTuple):
    """The options of every run: a machine, its bus and what is stored where."""

    machine: Path
    bus: str
    pacing: Pacing
    record: Path | None
    learned: Path | None
    mqtt: str | None
    fifo: bool

    def config(self) -> MachineConfig:
        """Load the machine, with its broker at the address of --mqtt. Raises ConfigError, BadParameter."""
        return with_broker(load_machine(self.machine), self.mqtt)

    def report(self, config: MachineConfig, program: ProgramConfig | None, **options: Any) -> RunReport:
        """Run with these further `options` of `run_machine`, and show the progress."""
        with progress_bar() as show:
            run = run_machine(
                config,
                program,
                self.bus,
                pacing=self.pacing,
                record_dir=self.record,
                on_progress=show,
                fifo=self.fifo,
                learned_dir=self.learned,
                self_test=True,
                **options,
            )
            return asyncio.run(run)


class ProgramChoice(NamedTuple):
    """The options that choose a program, and what a part program is read with."""

    path: Path | None
    inputs: Sequence[str]
    g54: str | None
    block_delete: bool


class PageChoice(NamedTuple):
    """The options of the operator's page."""

    listen: str | None
    access: Path | None
    language: str | None
    certificate: Path | None
    key: Path | None
    socket: Path | None

    def refuse_contradictions(self) -> None:
        """Refuse options that contradict each other. Raises typer.BadParameter."""
        if self.listen is None and (self.access or self.certificate or self.key):
            raise typer.BadParameter(
                "needs --hmi HOST:PORT", param_hint="--hmi-access, --hmi-certificate, --hmi-key"
            )
        if self.listen is not None and self.socket is not None:
            raise typer.BadParameter("--hmi and --hmi-socket exclude each other")

    def options(self) -> PageOptions | None:
        """Return what serves the page, and print its address; None without a page. Raises ServoCtrlError."""
        if self.listen is None:
            return PageOptions(None, socket=self.socket) if self.socket is not None else None
        page = page_at(self.listen, self.access, self.certificate, self.key, language=self.language)
        typer.echo(f"operator's bench: {url_of(self.listen, tls=self.certificate is not None)}")
        return page


def run_program(
    run: MachineRun,
    program: ProgramChoice,
    page: PageChoice,
    *,
    no_compensation: bool,
    observer: bool,
    serve: bool,
) -> None:
    """Run a program, print the outcome and exit accordingly. Raises ServoCtrlError, typer.BadParameter."""
    compensation = _compensation(no_compensation=no_compensation, observer=observer)
    page.refuse_contradictions()
    config = run.config()
    motion = read_program(
        program.path, config, program.inputs, program.g54, block_delete=program.block_delete
    )
    served = page.options()
    report = run.report(
        config,
        motion,
        serve=serve,
        compensation=compensation,
        stand_by=served is not None and motion is None,
        page=served,
    )
    conclude(config, report, motion)


def learn_axes(run: MachineRun, request: LearningRequest, *, resumable: bool) -> None:
    """Learn, print what was learned and exit accordingly; `resumable`: an interrupted run can continue.

    Raises ServoCtrlError and typer.BadParameter.
    """
    config = run.config()
    report = run.report(config, None, learn=request)
    print_learned(report, resumable=resumable)
    conclude(config, report)


def _compensation(*, no_compensation: bool, observer: bool) -> Compensation:
    if no_compensation and observer:
        raise typer.BadParameter("--no-compensation and --observer exclude each other")
    return "off" if no_compensation else "observer" if observer else "as configured"
