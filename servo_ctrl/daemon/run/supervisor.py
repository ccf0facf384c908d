"""The life of a run: check, open the bus, boot, cycle, NMT stop, close the recording, report."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

from servo_ctrl.canopen import node as own
from servo_ctrl.canopen.boot import boot_nodes
from servo_ctrl.canopen.nmt import NmtCommand, command_nodes
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.canopen.stack import Network
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.daemon.cycle.assembly import Assembly
from servo_ctrl.daemon.cycle.realtime import uninterrupted
from servo_ctrl.daemon.learning.pulse_compensation import Compensation
from servo_ctrl.daemon.page.page_process import PageOptions
from servo_ctrl.daemon.page.page_service import PageService
from servo_ctrl.daemon.run.assemble import assemble, build_axes
from servo_ctrl.daemon.run.changed_files import changes_told
from servo_ctrl.daemon.run.duplicate_master import LISTENING_S, report_others
from servo_ctrl.daemon.run.own_node import beating, fault_reporter, leave_nodes, subscribe
from servo_ctrl.daemon.run.report import Pacing, Progress, RunReport
from servo_ctrl.daemon.run.run_recording import RunRecording
from servo_ctrl.daemon.run.services import LearningRequest, RunOptions, Services
from servo_ctrl.daemon.run.session import Session
from servo_ctrl.daemon.run.stop_signals import StoppedError, stop_signals
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.io.can_port import BusError, CanPort, open_port
from servo_ctrl.recording.recorder import RecordingError
from servo_ctrl.recording.reversal_log import REVERSALS_FILE


async def run_machine(
    machine: MachineConfig,
    program: ProgramConfig | None,
    bus_spec: str,
    pacing: Pacing = "realtime",
    record_dir: Path | None = None,
    on_progress: Callable[[Progress], None] | None = None,
    *,
    fifo: bool = False,
    serve: bool = False,
    learned_dir: Path | None = None,
    compensation: Compensation = "as configured",
    learn: LearningRequest | None = None,
    stand_by: bool = False,
    page: PageOptions | None = None,
) -> RunReport:
    """Boot the machine on a bus ("INTERFACE:CHANNEL"), run the program or learn, stop, and report.

    Without a program, or with `serve`, the axes are held until SIGINT or SIGTERM. With `stand_by` a stop or
    a fault ends in standby, from which the operator enables the drives again; without a program and nothing
    to learn the run begins there, and no drive is switched on unasked. The learned functions are those in
    `learned_dir`, "learned" beside the machine file by default. `on_progress` is called ten times a second.
    `page` gives the run a local socket (docs/local_socket.md), and the operator's page on it. What goes wrong
    before the first SYNC raises a ServoCtrlError; afterwards it is in the report.
    """
    options = RunOptions(serve, learned_dir, compensation, learn, stand_by)
    supervisor = _Supervisor(machine, program, pacing, on_progress or (lambda _progress: None), options)
    if page is None:
        return await supervisor.run(bus_spec, record_dir, fifo=fifo)
    async with supervisor.with_page(page, record_dir).serving():
        return await supervisor.run(bus_spec, record_dir, fifo=fifo)


class _Supervisor:
    """One run. Making it is the offline part: files, limits, EDS, kernels."""

    def __init__(
        self,
        machine: MachineConfig,
        program: ProgramConfig | None,
        pacing: Pacing,
        on_progress: Callable[[Progress], None],
        options: RunOptions,
    ) -> None:
        self._config, self._program, self._pacing = machine, program, pacing
        self._lockstep = pacing == "lockstep"
        own.own_dictionary(machine)
        self._plans = plan_machine(machine)
        self._motion = MotionPlan(machine, program)
        self._places = build_axes(machine, self._plans)
        servos = [place.servo for place in self._places]
        self._services = services = Services(machine, self._motion, servos, options, lockstep=self._lockstep)
        self._session = Session(
            machine, self._motion, services, lockstep=self._lockstep, on_progress=on_progress
        )
        self._learned_dir = options.learned_dir
        self._page: PageService | None = None
        self._boot: asyncio.Task[None] | None = None
        self._signal = ""
        self._fifo = False

    def with_page(self, page: PageOptions, record_dir: Path | None) -> PageService:
        """The operator's page, to be served around `run`."""
        services = self._services
        self._page = PageService(
            page,
            self._config,
            self._plans,
            commands=services.desk,
            publisher=services.publisher,
            router=services.rows,
            note=services.note,
            learned_dir=self._learned_dir,
            record_dir=record_dir,
        )
        return self._page

    async def run(self, bus_spec: str, record_dir: Path | None, *, fifo: bool) -> RunReport:
        """The online part, from opening the bus to closing it."""
        self._fifo = fifo
        if fifo:
            with uninterrupted(fifo=True):
                pass  # refused now, before anything was touched, rather than after boot
        port = open_port(bus_spec)
        try:
            port.attach(asyncio.get_running_loop())
            network = Network(port.send)
            port.fallback = network.notify
            node = own.ControllerNode(network, self._config, self._services.desk)
            subscribe(node, self._services.publisher)
            with stop_signals(self._on_signal):
                await self._boot_nodes(port, network, node)
                return await self._recorded(port, network, node, record_dir)
        finally:
            port.close()

    async def _recorded(
        self, port: CanPort, network: Network, node: own.ControllerNode, record_dir: Path | None
    ) -> RunReport:
        """From before the first SYNC until the recording is closed."""
        assembly = self._assemble(port, network, node)
        desk, source = self._services.desk, self._program.source if self._program else None
        recording = RunRecording(
            record_dir, self._config, self._motion.steps, desk, program=source, pacing=self._pacing
        )
        self._services.rows.record = recording.record
        try:
            if record_dir is not None:
                self._services.production.log_to(record_dir / REVERSALS_FILE)
            await self._cycle(port, network, node, assembly, recording)
            port.finish()
        finally:
            # one instant for both books: whatever comes while they are written is in neither
            report = self._report(assembly, record_dir)
            problem = await asyncio.to_thread(self._close, recording, recording.ended(report))
        return report.unless(problem)

    async def _boot_nodes(self, port: CanPort, network: Network, node: own.ControllerNode) -> None:
        """Boot all nodes, with our heartbeat by the wall clock; a signal ends it at once."""
        others: set[str] = set()
        report_others(self._config, self._plans, port, others.add)
        self._boot = asyncio.create_task(asyncio.sleep(LISTENING_S))
        try:
            await self._boot
            if not others:
                node.boot_up()
                self._boot = asyncio.create_task(boot_nodes(network, self._plans))
                async with beating(node):
                    await self._boot
        except asyncio.CancelledError:
            if self._signal:
                raise StoppedError(f"stopped by {self._signal} before anything moved") from None
            raise
        finally:
            self._boot = None
        if others:
            raise BusError(min(others))
        if self._signal:
            raise StoppedError(f"stopped by {self._signal} before anything moved")

    def _close(self, recording: RunRecording, header: dict[str, Any]) -> str:
        """Write what is left of the recording and the reversals; what could not be written."""
        problem = recording.close(header)
        try:
            self._services.production.close()
        except RecordingError as error:
            return "; ".join(text for text in (problem, str(error)) if text)
        return problem

    def _assemble(self, port: CanPort, network: Network, node: own.ControllerNode) -> Assembly:
        services = self._services
        assembly = assemble(
            self._config,
            self._plans,
            self._places,
            port,
            node,
            lockstep=self._lockstep,
            record=services.rows.take,
            on_ready=services.on_ready,
            on_rest=services.on_rest,
            on_stop=services.on_stop,
            on_end=lambda: self._on_end(network, node, assembly.machine.stage),
            on_fault=fault_reporter(node),
        )
        services.attach(assembly)
        if self._page is not None:
            self._page.attach(assembly, port, network)
        return assembly

    async def _cycle(
        self,
        port: CanPort,
        network: Network,
        node: own.ControllerNode,
        assembly: Assembly,
        recording: RunRecording,
    ) -> None:
        """Start the nodes and cycle."""
        try:
            with uninterrupted(fifo=self._fifo):
                command_nodes(network, self._plans, NmtCommand.START)
                node.operational(running=True)
                with changes_told(self._config, self._plans, assembly.machine.note):
                    await self._session.run(assembly, recording, port)
        finally:
            assembly.cycle.stop()

    def _on_end(self, network: Network, node: own.ControllerNode, stage: Stage) -> None:
        """The cycle has stopped."""
        leave_nodes(network, self._plans, node, stage)
        self._session.on_end()

    def _report(self, assembly: Assembly, record_dir: Path | None) -> RunReport:
        machine, cycle = assembly
        services = self._services
        return RunReport(
            machine=self._config.machine.name,
            completed=services.completed,
            failed=machine.failed or bool(services.problem),
            signal=self._signal,
            reason="; ".join(text for text in (machine.reason, services.problem) if text),
            events=tuple(machine.events.kept),
            cycles=cycle.number + 1,
            missed_ticks=machine.missed_ticks,
            missing_inputs=machine.missing_inputs,
            wall_s=self._session.wall_s,
            spans=tuple(self._motion.spans),
            lateness=self._session.lateness,
            recording=record_dir,
            learning=services.job.status(),
            outcomes=tuple(services.job.outcomes),
        )

    def _on_signal(self, name: str) -> None:
        self._signal = name
        if self._boot is not None:
            self._boot.cancel()
        self._session.stop(name)
