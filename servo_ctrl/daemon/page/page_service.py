"""Serves the operator's page beside a run: the local socket, its messages, and the page's process."""

import asyncio
import contextlib
import logging
import os
import shutil
import sys
import tempfile
from collections.abc import AsyncIterator, Awaitable, Callable, Generator, Sequence
from pathlib import Path
from typing import Any

from kernels.arrays import Array
from kernels.thread_priority import lower_priority
from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.commands.client_activity import ClientActivity
from servo_ctrl.commands.command import CommandResult, Refusal
from servo_ctrl.commands.handler import CommandHandler
from servo_ctrl.commands.local_messages import (
    AxisInfo,
    ChannelInfo,
    Hello,
    NodeInfo,
    Reversal,
    TuningRun,
    message_json,
)
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.config.load import load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.part_program import PartProgram, ReadingOptions
from servo_ctrl.config.program_model import ProgramConfig, SamplesStep
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.cycle.rows import RowRouter
from servo_ctrl.daemon.page.bus_watch import BusWatch
from servo_ctrl.daemon.page.object_access import ObjectAccess
from servo_ctrl.daemon.page.page_process import PageOptions, kept_running
from servo_ctrl.daemon.page.row_tap import RowTap
from servo_ctrl.errors import ConfigError
from servo_ctrl.io.can_port import CanPort
from servo_ctrl.learned.store import default_directory
from servo_ctrl.learning.types import ReversalReport
from servo_ctrl.recording.channels import channels_of
from servo_ctrl.recording.command_log import COMMANDS_FILE, CommandLog
from servo_ctrl.telemetry.local_socket.requests import LocalRequests, Outcome, RequestTargets
from servo_ctrl.telemetry.local_socket.rows import RowBuffer
from servo_ctrl.telemetry.local_socket.server import ROWS_PERIOD_S, LocalServer
from servo_ctrl.telemetry.local_socket.status import StatusEncoder
from servo_ctrl.units import MM

LINE_NAME = "line.ngc"
"""Name of a single line of G-code in messages."""
_LOG = logging.getLogger(__name__)


class PageService:
    """Made before the bus is opened; `serving` encloses the run, `attach` follows the boot."""

    def __init__(
        self,
        options: PageOptions,
        config: MachineConfig,
        plans: Sequence[NodePlan],
        machine: MachineController,
        objects: ObjectAccess,
        *,
        commands: CommandHandler,
        publisher: StatusPublisher,
        router: RowRouter,
        learned_dir: Path | None,
        record_dir: Path | None,
        tuning_run: Callable[[TuningRun, Path, ClientActivity], Awaitable[CommandResult]],
        lockstep: bool,
    ) -> None:
        self._options, self._config, self._plans, self._machine = options, config, plans, machine
        self._commands, self._publisher, self._router = commands, publisher, router
        self._learned_dir = learned_dir or default_directory(config)
        self._record_dir, self._lockstep, self._make_tuning_run = record_dir, lockstep, tuning_run
        self._log: CommandLog | None = None
        self._programs: Path | None = None
        self._tuning_recording: Path | None = None
        """Directory of the recording of the last motion of a tuning."""
        rows = RowBuffer(len(channels_of(config.axes)))
        self._tap = RowTap(rows, config.period_s, ROWS_PERIOD_S)
        self._watch = BusWatch(plans, machine, self._tap, config.bus.bit_rate_kbit_s * 1000)
        self._encoder = StatusEncoder()
        targets = RequestTargets(
            commands=commands,
            objects=objects,
            read_program=lambda program: asyncio.to_thread(
                self._read_program, program.name, program.text, commands.reading(program.first_line)
            ),
            read_line=lambda line: asyncio.to_thread(self._read_line, line, commands.reading_of_line()),
            tuning_run=self._tuning_run,
            clear_counters=self._watch.clear,
            log=self._add_to_log,
            note=machine.note,
            cycle=lambda: machine.cycles - 1,
        )
        self._server = LocalServer(self._hello(), LocalRequests(targets), rows, self._status)

    @contextlib.asynccontextmanager
    async def serving(self) -> AsyncIterator[None]:
        """Serve the socket and run the page's process while the block runs. Raises ServoCtrlError."""
        loop = asyncio.get_running_loop()
        self._log = await asyncio.to_thread(self._open_log, loop)
        try:
            async with (
                self._server.serving(self._options.socket) as socket,
                contextlib.AsyncExitStack() as stack,
            ):
                self._programs = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="servo-ctrl-")))
                if self._options.on_socket is not None:
                    self._options.on_socket(socket)
                if self._options.arguments is not None:
                    page = (sys.executable, "-m", "servo_ctrl.hmi", "serve", "--socket", str(socket))
                    command = [*page, *self._options.arguments]
                    await stack.enter_async_context(kept_running(command, self._machine.note))
                self._tap.on_due = lambda: loop.call_soon(self._step)
                self._router.page = self._tap.take
                self._publisher.on_change.append(self._server.changed)
                self._publisher.on_reversal.append(self._on_reversal)
                yield
        finally:
            problem = await asyncio.to_thread(self._log.close)
            if problem:
                _LOG.warning("%s", problem)

    def attach(self, port: CanPort) -> None:
        """Monitor the bus, whose nodes have booted."""
        self._watch.listen(port)

    def _on_reversal(self, axis: str, report: ReversalReport, trace_m: Array) -> None:
        """Publish a reversal after the tick that evaluated it."""
        error_m = trace_m.copy()

        def message() -> bytes:
            reversal = Reversal(axis, report, self._config.period_s, tuple(error_m.tolist()))
            return message_json("reversal", reversal)

        self._server.send_later(message)

    def _step(self) -> None:
        if self._server.step():
            self._tap.again()

    def _open_log(self, loop: asyncio.AbstractEventLoop) -> CommandLog:
        def problem(text: str) -> None:
            _LOG.warning("%s", text)
            with contextlib.suppress(RuntimeError):  # the run is over
                loop.call_soon_threadsafe(self._machine.note, text)

        return CommandLog((self._record_dir or self._learned_dir) / COMMANDS_FILE, problem)

    def _add_to_log(self, entry: dict[str, Any]) -> None:
        if self._log is not None:
            self._log.add(entry)

    def _status(self) -> Generator[None, None, bytes]:
        """Encode the status in pieces, each shorter than the idle time of a period."""
        status = self._commands.status()
        yield
        figures = self._watch.figures()
        yield
        return (yield from self._encoder.pieces(status, figures))

    def _read_line(self, line: str, reading: ReadingOptions) -> PartProgram:
        """Read a line of G-code. Raises ConfigError."""
        program = self._read_program(LINE_NAME, line, reading)
        if "\n" in line.strip() or not isinstance(program, PartProgram):
            raise ConfigError(LINE_NAME, "", "one line at a time")
        return program

    def _read_program(self, name: str, text: str, reading: ReadingOptions) -> ProgramConfig:
        """Read a program that the page sent. Raises ConfigError, which names the program, not its path."""
        lower_priority()
        if self._programs is None or name in {".", ".."}:
            raise ConfigError(name, "", "is not a name of a file")
        path = self._programs / name
        try:
            path.write_text(text, encoding="utf-8")
        except (OSError, ValueError) as error:
            raise ConfigError(name, "", f"cannot be kept: {error}") from None
        try:
            program = load_program(path, self._config, reading=reading)
        except ConfigError as error:
            raise ConfigError(name, error.key, error.reason.replace(f"{path}", name)) from None
        if any(isinstance(step, SamplesStep) for step in program.steps):
            raise ConfigError(name, "", "samples of a file are run by `servo-ctrl run --program` only")
        return program

    async def _tuning_run(self, request: TuningRun, activity: ClientActivity) -> Outcome:
        """Make a motion of a tuning; its recording replaces the one before. Raises ServoCtrlError."""
        if self._programs is None:
            return Outcome(Refusal.WRONG_STATE, "the run is over")
        with contextlib.ExitStack() as on_failure:
            directory = Path(tempfile.mkdtemp(dir=self._programs))
            on_failure.callback(shutil.rmtree, directory, ignore_errors=True)
            result = await self._make_tuning_run(request, directory / "recording", activity)
            if not result.accepted:
                return Outcome(result.refusal, result.reason)
            on_failure.pop_all()
        if self._tuning_recording is not None:
            await asyncio.to_thread(shutil.rmtree, self._tuning_recording, ignore_errors=True)
        self._tuning_recording = directory
        return Outcome(value=str(directory / "recording"))

    def _hello(self) -> bytes:
        config = self._config
        axes = tuple(
            AxisInfo(
                name=name,
                travel_m=(axis.limits.position_mm[0] * MM, axis.limits.position_mm[1] * MM),
                velocity_m_s=axis.limits.velocity_mm_s * MM,
            )
            for name, axis in config.axes.items()
        )
        channels = tuple(
            ChannelInfo(name=channel.name, unit=channel.unit, meaning=channel.meaning)
            for channel in channels_of(config.axes)
        )
        nodes = tuple(
            NodeInfo(name=plan.key, node_id=plan.node_id, eds=str(plan.eds.path)) for plan in self._plans
        )
        hello = Hello(
            machine=config.machine.name,
            period_s=config.period_s,
            axes=axes,
            channels=channels,
            nodes=nodes,
            machine_file=str(config.source.resolve()),
            learned_dir=str(self._learned_dir.resolve()),
            record_dir=None if self._record_dir is None else str(self._record_dir.resolve()),
            pid=os.getpid(),
            lockstep=self._lockstep,
            machine_sha256=config.source_sha256,
        )
        return message_json("hello", hello)
