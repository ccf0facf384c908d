"""The life of a run: check, open the bus, boot, cycle, NMT stop, close the recording, report."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import threading
from typing import TYPE_CHECKING

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.canopen import node as own
from servo_ctrl.canopen.boot import NMT_ENTER_PRE_OPERATIONAL, NMT_START, boot_nodes, command_nodes
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.canopen.stack import Network
from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.daemon.assembly import Assembly, assemble, build_axes
from servo_ctrl.daemon.desk import ControllerDesk
from servo_ctrl.daemon.motion_plan import MotionPlan
from servo_ctrl.daemon.realtime import uninterrupted
from servo_ctrl.daemon.report import Pacing, Progress, RunReport
from servo_ctrl.daemon.run_recording import RunRecording
from servo_ctrl.daemon.session import Session
from servo_ctrl.daemon.sole_controller import LISTENING_S, report_others
from servo_ctrl.io.can_port import BusError, open_port

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.config.program_model import ProgramConfig
    from servo_ctrl.io.can_port import CanPort

BOOT_HEARTBEAT_S = 0.05
"""How often we look whether we have a heartbeat while there is no SYNC to count."""
EMCY_OF_EVENT = {
    Event.LOST_HEARTBEAT: own.EMCY_HEARTBEAT,
    Event.LOST_TPDO: own.EMCY_PDO_TIMEOUT,
    Event.FOLLOWING_ERROR: own.EMCY_FOLLOWING_ERROR,
}


class StoppedError(ServoCtrlError):
    """A signal came before anything moved."""


async def run_machine(
    machine: MachineConfig,
    program: ProgramConfig | None,
    bus_spec: str,
    pacing: Pacing = "realtime",
    record_dir: Path | None = None,
    on_progress: Callable[[Progress], None] | None = None,
    *,
    fifo: bool = False,
) -> RunReport:
    """Boot the machine on a bus ("INTERFACE:CHANNEL"), run the program, stop, and report.

    Without a program the axes are held until SIGINT or SIGTERM. `on_progress` is called ten times a second.
    What goes wrong before the first SYNC raises a ServoCtrlError; afterwards it is in the report.
    """
    supervisor = _Supervisor(machine, program, pacing, on_progress or (lambda _progress: None))
    return await supervisor.run(bus_spec, record_dir, fifo=fifo)


class _Supervisor:
    """One run. Making it is the offline part: files, limits, EDS, kernels."""

    def __init__(
        self,
        machine: MachineConfig,
        program: ProgramConfig | None,
        pacing: Pacing,
        on_progress: Callable[[Progress], None],
    ) -> None:
        self._config, self._program, self._pacing = machine, program, pacing
        self._lockstep = pacing == "lockstep"
        own.own_dictionary(machine)
        self._plans = plan_machine(machine)
        self._motion = MotionPlan(machine, program)
        self._places = build_axes(machine, self._plans)
        self._desk = ControllerDesk(machine)
        self._session = Session(machine, self._motion, lockstep=self._lockstep, on_progress=on_progress)
        self._assembly: Assembly | None = None
        self._boot: asyncio.Task[None] | None = None
        self._signal = ""
        self._recording_problem = ""

    async def run(self, bus_spec: str, record_dir: Path | None, *, fifo: bool) -> RunReport:
        """The online part, from opening the bus to closing it."""
        if fifo:
            with uninterrupted(fifo=True):
                pass  # refused now, before anything was touched, rather than after boot
        port = open_port(bus_spec)
        try:
            port.attach(asyncio.get_running_loop())
            network = Network(port.send)
            port.fallback = network.notify
            node = own.ControllerNode(network, self._config, self._desk)
            with self._signals():
                await self._boot_nodes(port, network, node)
                recording = RunRecording(
                    record_dir,
                    self._config,
                    self._motion.steps,
                    program=self._program.source if self._program is not None else None,
                    pacing=self._pacing,
                )
                try:
                    assembly = self._assemble(port, node, recording)
                    await self._cycle(network, node, assembly, recording, fifo=fifo)
                finally:
                    machine = self._assembly.machine if self._assembly is not None else None
                    self._recording_problem = await asyncio.to_thread(recording.close, machine)
        finally:
            port.close()
        return self._report(assembly, record_dir)

    async def _boot_nodes(self, port: CanPort, network: Network, node: own.ControllerNode) -> None:
        """Boot all nodes, with our heartbeat by the wall clock; a signal ends it at once."""
        others: set[str] = set()
        report_others(self._config, self._plans, port, others.add)
        self._boot = asyncio.create_task(asyncio.sleep(LISTENING_S))
        heartbeat: asyncio.Task[None] | None = None
        try:
            await self._boot
            if not others:
                node.boot_up()
                heartbeat = asyncio.create_task(_beat(node))
                self._boot = asyncio.create_task(boot_nodes(network, self._plans))
                await self._boot
        except asyncio.CancelledError:
            if self._signal:
                raise StoppedError(f"stopped by {self._signal} before anything moved") from None
            raise
        finally:
            self._boot = None
            if heartbeat is not None:
                heartbeat.cancel()
                await asyncio.gather(heartbeat, return_exceptions=True)
        if others:
            raise BusError(min(others))
        if self._signal:
            raise StoppedError(f"stopped by {self._signal} before anything moved")

    def _assemble(self, port: CanPort, node: own.ControllerNode, recording: RunRecording) -> Assembly:
        def on_fault(event: Event, text: str) -> None:
            with contextlib.suppress(BusError):  # the bus may be what failed
                node.report_error(EMCY_OF_EVENT.get(event, own.EMCY_GENERIC), text)

        self._assembly = assemble(
            self._config,
            self._plans,
            self._places,
            port,
            node,
            lockstep=self._lockstep,
            record=recording.record,
            on_ready=self._session.on_ready,
            on_rest=lambda: None,
            on_stop=lambda _text: None,
            on_end=self._session.on_end,
            on_fault=on_fault,
        )
        self._desk.attach(self._assembly)
        return self._assembly

    async def _cycle(
        self,
        network: Network,
        node: own.ControllerNode,
        assembly: Assembly,
        recording: RunRecording,
        *,
        fifo: bool,
    ) -> None:
        """Start the nodes, cycle, and take the nodes back to pre-operational whatever happened."""
        try:
            with uninterrupted(fifo=fifo):
                command_nodes(network, self._plans, NMT_START)
                node.operational(running=True)
                await self._session.run(assembly, recording.publish)
        finally:
            with contextlib.suppress(BusError):
                command_nodes(network, self._plans, NMT_ENTER_PRE_OPERATIONAL)
                node.operational(running=False)
                node.send_heartbeat()

    def _report(self, assembly: Assembly, record_dir: Path | None) -> RunReport:
        machine, cycle = assembly
        return RunReport(
            machine=self._config.machine.name,
            completed=machine.completed,
            failed=machine.failed or bool(self._recording_problem),
            signal=self._signal,
            reason="; ".join(text for text in (machine.reason, self._recording_problem) if text),
            events=tuple(machine.events),
            cycles=cycle.number + 1,
            missed_ticks=machine.missed_ticks,
            missing_inputs=machine.missing_inputs,
            wall_s=self._session.wall_s,
            spans=tuple(machine.program.spans) if machine.program is not None else (),
            lateness=self._session.lateness,
            recording=record_dir,
        )

    @contextlib.contextmanager
    def _signals(self) -> Iterator[None]:
        """SIGINT and SIGTERM stop the machine in order; outside the main thread they are not ours."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        loop = asyncio.get_running_loop()
        wanted = (signal.SIGINT, signal.SIGTERM)
        for number in wanted:
            loop.add_signal_handler(number, self._on_signal, number)
        try:
            yield
        finally:
            for number in wanted:
                loop.remove_signal_handler(number)

    def _on_signal(self, number: signal.Signals) -> None:
        self._signal = number.name
        if self._boot is not None:
            self._boot.cancel()
        self._session.stop(number.name)


async def _beat(node: own.ControllerNode) -> None:
    while True:
        node.send_heartbeat()
        await asyncio.sleep(node.heartbeat_s or BOOT_HEARTBEAT_S)
