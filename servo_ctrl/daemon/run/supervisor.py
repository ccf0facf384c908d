"""The phases of a run: check, open the bus, boot, cycle, NMT stop, close the recording, report."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

from kernels.compiler_memory import release_compiler
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.canopen.bus_load import check_load
from servo_ctrl.canopen.nmt import NmtCommand, command_nodes
from servo_ctrl.canopen.node import load_own_eds
from servo_ctrl.canopen.own_settings import FILE
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.canopen.stack import LOCKSTEP_SDO_TIMEOUT_S, SDO_TIMEOUT_S, Network
from servo_ctrl.config.contour import contour_note
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.daemon.cycle.cycle import Cycle
from servo_ctrl.daemon.cycle.realtime import uninterrupted
from servo_ctrl.daemon.learning.learned_compensation import Compensation
from servo_ctrl.daemon.page.object_access import ObjectAccess
from servo_ctrl.daemon.page.page_process import PageOptions
from servo_ctrl.daemon.page.page_service import PageService
from servo_ctrl.daemon.run.assemble import build_axes, build_machine, connect
from servo_ctrl.daemon.run.boot_again import BootAgain
from servo_ctrl.daemon.run.changed_files import changes_noted
from servo_ctrl.daemon.run.first_boot import FirstBoot, RunBus
from servo_ctrl.daemon.run.own_node import leave_nodes, stored_node, subscribe
from servo_ctrl.daemon.run.report import Pacing, Progress, RunReport
from servo_ctrl.daemon.run.round_trip import measure_round_trip
from servo_ctrl.daemon.run.run_options import LearningRequest, RunOptions
from servo_ctrl.daemon.run.run_recording import RunRecording
from servo_ctrl.daemon.run.self_test import objection
from servo_ctrl.daemon.run.services import Services
from servo_ctrl.daemon.run.session import Session
from servo_ctrl.daemon.run.stop_signals import stop_signals
from servo_ctrl.daemon.run.temperatures import Temperatures
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.io.bit_rate import rate_problem
from servo_ctrl.io.can_port import open_port
from servo_ctrl.learned.store import default_directory
from servo_ctrl.recording.recorder import RecordingError
from servo_ctrl.recording.reversal_log import REVERSALS_FILE


async def run_machine(
    machine: MachineConfig,
    program: ProgramConfig | None,
    bus_spec: str,
    pacing: Pacing = "realtime",
    record_dir: Path | None = None,
    on_progress: Callable[[Progress], None] = lambda _progress: None,
    *,
    fifo: bool = False,
    serve: bool = False,
    learned_dir: Path | None = None,
    compensation: Compensation = "as configured",
    learn: LearningRequest | None = None,
    stand_by: bool = False,
    page: PageOptions | None = None,
    self_test: bool = False,
) -> RunReport:
    """Boot the machine on a bus ("INTERFACE:CHANNEL"), run the program or learn, stop, and report.

    Without a program, or with `serve`, the axes hold until SIGINT or SIGTERM. With `stand_by` a stop or a
    fault ends in standby, from which the operator enables the drives again; without program and learning the
    run also begins there, so that no drive gets power unrequested. `learned_dir` holds the learned functions,
    by default "learned" beside the machine file. `on_progress` is called ten times a second. `page` adds a
    local socket (docs/local_socket.md) with the operator's page on it. With `self_test` a run in real time
    first tests for four seconds, two of ticks and two of cycles, whether the computer holds the period; only
    then do drives get power. Errors before the first SYNC raise a ServoCtrlError, the report has later ones.
    """
    options = RunOptions(
        serve=serve, learned_dir=learned_dir, compensation=compensation, learn=learn, stand_by=stand_by
    )
    supervisor = _Supervisor(
        machine, program, pacing, record_dir, on_progress=on_progress, options=options, fifo=fifo
    )
    if self_test and pacing == "realtime":
        await supervisor.test_computer()
    if page is None:
        return await supervisor.run(bus_spec)
    async with supervisor.with_page(page).serving():
        return await supervisor.run(bus_spec)


class _Supervisor:
    """One run. The constructor is the offline part: files, limits, EDS, kernels."""

    def __init__(
        self,
        config: MachineConfig,
        program: ProgramConfig | None,
        pacing: Pacing,
        record_dir: Path | None,
        on_progress: Callable[[Progress], None],
        options: RunOptions,
        *,
        fifo: bool,
    ) -> None:
        self._config, self._program, self._pacing = config, program, pacing
        self._record_dir, self._learned_dir, self._fifo = record_dir, options.learned_dir, fifo
        self._lockstep = lockstep = pacing == "lockstep"
        self._sdo_timeout_s = LOCKSTEP_SDO_TIMEOUT_S if lockstep else SDO_TIMEOUT_S
        load_own_eds(config)
        self._plans = plan_machine(config)
        check_load(config, self._plans)
        self._motion = MotionPlan(config, program)
        self._places = build_axes(config, self._plans)
        self._machine = build_machine(config, self._plans, self._places, lockstep=lockstep)
        self._objects = ObjectAccess(self._plans, self._machine)
        servos = [place.servo for place in self._places]
        self._services = Services(config, self._motion, self._machine, servos, options, lockstep=lockstep)
        self._session = Session(config, self._motion, self._services, on_progress, lockstep=lockstep)
        self._page: PageService | None = None
        self._boot = FirstBoot(config, self._plans, self._sdo_timeout_s)
        release_compiler()  # all kernels are loaded
        self._signal = ""
        self._tested = False

    def with_page(self, page: PageOptions) -> PageService:
        """Make the operator's page, which the caller serves around `run`."""
        self._page = PageService(
            page,
            self._config,
            self._plans,
            self._machine,
            self._objects,
            commands=self._services.handler,
            publisher=self._services.publisher,
            router=self._services.rows,
            learned_dir=self._learned_dir,
            record_dir=self._record_dir,
            tuning_run=self._services.tuning.run,
            lockstep=self._lockstep,
        )
        return self._page

    async def test_computer(self) -> None:
        """Test the ticks before the bus is opened; log an event if the computer does not hold the period."""
        self._tested = True
        with uninterrupted(fifo=self._fifo, realtime=True):
            if problem := await objection(self._config.bus.sync_period_us * 1000):
                self._machine.note(problem)

    async def run(self, bus_spec: str) -> RunReport:
        """Run the online part, from opening the bus to closing it."""
        if self._fifo:
            with uninterrupted(fifo=True, realtime=True):
                pass  # a refusal of --fifo shows now, before the bus is opened, rather than after the boot
        port = open_port(bus_spec)
        if problem := await asyncio.to_thread(rate_problem, bus_spec, self._config.bus.bit_rate_kbit_s):
            self._machine.note(problem)
        if note := contour_note(self._config):
            self._machine.note(note)
        try:
            port.attach(asyncio.get_running_loop())
            network = Network(port.send)
            port.fallback = network.notify
            services = self._services
            file = (self._learned_dir or default_directory(self._config)) / FILE
            node = stored_node(
                network,
                self._config,
                handler=services.handler,
                file=file,
                worker=services.worker,
                note=self._machine.note,
            )
            bus = RunBus(port, network, node)
            subscribe(bus.node, services.publisher)
            with stop_signals(self._on_signal):
                await self._boot.run(bus)
                return await self._run_recorded(bus)
        finally:
            port.close()

    async def _run_recorded(self, bus: RunBus) -> RunReport:
        """Run the cycle with its recording, from before the first SYNC until the recording is closed."""
        services = self._services
        cycle = connect(
            self._config,
            self._plans,
            self._places,
            self._machine,
            port=bus.port,
            node=bus.node,
            lockstep=self._lockstep,
            on_end=lambda: self._on_end(bus),
        )
        if self._tested:
            servos = [place.servo for place in self._places]
            measure_round_trip(cycle, servos, self._config.period_s, self._machine.note)
        boot_again = BootAgain(bus.network, self._plans, self._machine, self._sdo_timeout_s)
        if self._machine.nodes is not None:
            self._machine.nodes.boot = boot_again.begin
        self._session.background.append(boot_again.run)
        services.begin()
        self._objects.attach(bus.network)
        warmed = services.learning.waveform_adaptation.warmed
        temperatures = Temperatures(self._config, self._machine, self._objects, warmed)
        self._session.background.append(temperatures.run)
        if self._page is not None:
            self._page.attach(bus.port)
        recording = RunRecording(
            self._record_dir,
            self._config,
            self._motion.steps,
            services.handler,
            program=self._program.source if self._program else None,
            pacing=self._pacing,
        )
        if recording.record is not None:
            self._machine.keep_row = recording.record
        try:
            if self._record_dir is not None:
                services.learning.production.log_to(self._record_dir / REVERSALS_FILE)
            await self._run_cycle(bus, cycle, recording)
            bus.port.finish()
        finally:
            # made at one instant, so that a later event is in neither report nor header
            report = self._session.report(cycle, self._signal, self._record_dir)
            problem = await asyncio.to_thread(self._close, recording, recording.final_header(report))
        return report.with_problem(problem)

    async def _run_cycle(self, bus: RunBus, cycle: Cycle, recording: RunRecording) -> None:
        """Start the nodes and run the cycle."""
        try:
            with uninterrupted(fifo=self._fifo, realtime=not self._lockstep):
                command_nodes(bus.network, self._plans, NmtCommand.START)
                bus.node.operational(running=True)
                with changes_noted(self._config, self._plans, self._machine.note):
                    await self._session.run(cycle, recording, bus.port)
        finally:
            cycle.stop()

    def _on_end(self, bus: RunBus) -> None:
        """Set the nodes to their final NMT state once the cycle has stopped."""
        try:
            leave_nodes(bus.network, self._plans, bus.node, self._machine.stage)
        finally:
            self._session.ended.set()

    def _close(self, recording: RunRecording, header: dict[str, Any]) -> str:
        """Write the rest of recording and reversal log; return what could not be written, else ""."""
        problem = recording.close(header)
        try:
            self._services.learning.production.close()
        except RecordingError as error:
            return "; ".join(text for text in (problem, str(error)) if text)
        return problem

    def _on_signal(self, name: str) -> None:
        self._signal = name
        if not self._boot.stop(name):
            self._machine.event(Event.STOP_SIGNAL, f"stopped by {name}")
