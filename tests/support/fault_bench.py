"""The daemon's cycle, machine and boot against the simulator's nodes, in one process, without a wall clock.

Frames are delivered in the order of the bus. A test injects a fault of `hil_sim.faults`, or a frame.
Controlwords, events and true table positions are logged by cycle.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import canopen
import numpy as np
from fake_command_handler import FakeCommandHandler

from hil_sim.config import load_plant
from hil_sim.faults.schedule import read_fault
from hil_sim.runner.bench import SimulatedMachine
from hil_sim.runner.pacing import Lockstep
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.canopen.boot import _boot_node
from servo_ctrl.canopen.nmt import NmtCommand, command_nodes
from servo_ctrl.canopen.node import ControllerNode
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.canopen.stack import Network
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.program import program_segments
from servo_ctrl.daemon.run.assemble import build_axes, build_machine, connect
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.motion.move import Move
from servo_ctrl.recording.channels import AXIS_CHANNELS

BRAKE, POWER_OFF = 0x02, 0x00
"""Controlwords: quick stop, disable voltage."""
FEED_M_S = 0.05
FAR = Move("far", (0.06, 0.04), FEED_M_S, np.inf, trapezoidal=False)
REST_M_S = 1e-3
_import_od = cache(canopen.import_od)
"""Every EDS is parsed once; neither side changes its object dictionary."""
COLUMN = {channel.name: place for place, channel in enumerate(AXIS_CHANNELS)}
SHARED = 3
"""Columns ahead of those of the axes."""


class FaultBench:
    """The table of a machine directory, its daemon in lockstep. `run` advances; the move starts by itself."""

    def __init__(self, machine_dir: Path, *faults: str, plant: Path | None = None) -> None:
        with patch.object(canopen, "import_od", _import_od):
            self._make(machine_dir, faults, plant)

    def _make(self, machine_dir: Path, faults: tuple[str, ...], plant: Path | None) -> None:
        self.config = load_machine(machine_dir)
        self.controlwords: list[tuple[int, int, int]] = []
        """(cycle, node, controlword) of every RPDO."""
        self.sent: list[tuple[int, int, bytes]] = []
        """(cycle, identifier, data) of the other frames of the daemon."""
        self.rows: list[list[float]] = []
        self.events: list[tuple[int, Event]] = []
        """(cycle, event) of the machine."""
        self.truth_m: list[list[float]] = []
        """True table positions, by cycle."""
        self.off = False
        self.name = "bench"
        self.handlers: dict[int, Callable[[bytearray, float], None]] = {}
        self.on_down: Any = None
        self.on_error_frame: Any = None
        self._wire: deque[tuple[bool, int, bytes]] = deque()
        self.nodes = SimulatedMachine(
            load_plant(plant or machine_dir), self._from_nodes, None, [read_fault(text) for text in faults]
        )
        Lockstep(self.nodes)
        self.network = Network(self.send)
        self.plans = plan_machine(self.config)
        self._boot()
        node = ControllerNode(self.network, self.config, FakeCommandHandler())
        node.boot_up()
        places = build_axes(self.config, self.plans)
        self.machine = build_machine(self.config, self.plans, places, lockstep=True)
        self.machine.record, self.machine.on_ready = self.rows.append, self._move
        self.cycle = connect(
            self.config,
            self.plans,
            places=places,
            machine=self.machine,
            port=self,  # type: ignore[arg-type]  # as far as a port is asked for
            node=node,
            lockstep=True,
            on_end=self._on_end,
        )
        self.machine.begin()
        self._note_events()
        command_nodes(self.network, self.plans, NmtCommand.START)
        node.operational(running=True)

    # --- the interface of a CAN port --------------------------------------------------------------

    def frame(self, can_id: int) -> _Frame:
        return _Frame(self, can_id)

    def flush(self) -> None:
        """Frames are on the wire as soon as they are sent."""

    def read_arrived(self) -> bool:
        """No frame waits: the cycle handles each as soon as it is sent."""
        return False

    def send(self, can_id: int, payload: bytes) -> None:
        if can_id & 0x780 == 0x200:
            self.controlwords.append((self.cycle.number, can_id & 0x7F, payload[0]))
        elif hasattr(self, "cycle"):
            self.sent.append((self.cycle.number, can_id, bytes(payload)))
        self._wire.append((True, can_id, bytes(payload)))

    def fail(self, error: Exception) -> None:
        raise error

    # --- the run ----------------------------------------------------------------------------------

    def run(self, cycles: int) -> FaultBench:
        """Run `cycles` cycles, fewer if the machine switches off; stops after the inputs of the last."""
        last = self.cycle.number + cycles
        if self.cycle.number < 0:
            self.cycle.begin()
        while not self.off and self.cycle.number <= last:
            if not self._wire:
                self.cycle.complete_without_missing()
            while self._wire and not (self._wire[0][:2] == (True, 0x080) and self.cycle.number > last):
                self._deliver(*self._wire.popleft())
        return self

    def inject(self, can_id: int, payload: bytes) -> int:
        """Inject a frame of another sender before the next SYNC; return its cycle."""
        self._wire.appendleft((False, can_id, payload))
        self.nodes.handle(can_id, payload)
        return self.cycle.number

    def noted(self, event: Event) -> int:
        """The cycle of the first such event."""
        return next(cycle for cycle, found in self.events if found is event)

    def reacted(self, node: int, controlword: int) -> int:
        """The first cycle, after the axes moved, whose RPDO sent a drive this controlword."""
        moved = self.moving[0]
        return next(
            c for c, target, word in self.controlwords if (target, word) == (node, controlword) and c > moved
        )

    @property
    def moving(self) -> list[int]:
        """Cycles with moving set points."""
        column = SHARED + COLUMN["velocity_command_m_s"]
        return [int(row[1]) for row in self.rows if abs(row[column]) > 0.0]

    def ramp(self) -> int:
        """The first cycle in which the set points slowed down."""
        column = SHARED + COLUMN["velocity_command_m_s"]
        speeds = [(int(row[1]), abs(row[column])) for row in self.rows]
        moving = [(cycle, speed) for cycle, speed in speeds if cycle >= self.moving[0]]
        return next(b[0] for a, b in itertools.pairwise(moving) if b[1] < a[1] * (1.0 - 1e-9))

    def at_rest(self, axis: int, over: int = 20) -> bool:
        """Whether the table hardly moved in the last cycles; without power presliding friction relaxes."""
        last = [at[axis] for at in self.truth_m[-over:]]
        return max(last) - min(last) < over * 1e-3 * REST_M_S

    def emcy(self) -> list[int]:
        """Error codes of the controller's emergency messages."""
        own = 0x080 + self.config.controller.node_id
        return [int.from_bytes(data[:2], "little") for _, can_id, data in self.sent if can_id == own]

    def _boot(self) -> None:
        self._booting = True
        self.nodes.start()
        for plan in self.plans:
            _boot_node(_Direct(self), plan, set(), 0.1)  # type: ignore[arg-type]  # as far as SDO asks
        self._wire.clear()
        self._booting = False

    def _from_nodes(self, can_id: int, payload: bytes) -> None:
        if getattr(self, "_booting", True):
            if hasattr(self, "network"):
                self.network.notify(can_id, bytearray(payload), 0.0)
            return
        self._wire.append((False, can_id, bytes(payload)))

    def fallback(self, can_id: int, payload: bytearray, timestamp_s: float) -> None:
        """Called for a frame without a handler."""
        self.network.notify(can_id, payload, timestamp_s)

    def _deliver(self, to_nodes: bool, can_id: int, payload: bytes) -> None:
        if not to_nodes:
            handler = self.handlers.get(can_id)
            if handler is not None:
                handler(bytearray(payload), 0.0)
            else:
                self.fallback(can_id, bytearray(payload), 0.0)
        else:
            self.nodes.handle(can_id, payload)
            if can_id == 0x080:
                self.truth_m.append(self.nodes.plant.state["table_position_m"].tolist())

    def _move(self) -> None:
        segments = program_segments([FAR], self.config, self.machine.set_points_m())
        self.machine.run(ProgramReference(segments))

    def _on_end(self) -> None:
        self.off = True

    def _note_events(self) -> None:
        handle = self.machine._incidents.handle

        def noted(stage: Stage, event: Event, text: str, cycle: int) -> Any:
            self.events.append((self.cycle.number, event))
            return handle(stage, event, text, cycle)

        self.machine._incidents.handle = noted  # type: ignore[method-assign]  # and then as it was


class _Frame:
    def __init__(self, bench: FaultBench, can_id: int) -> None:
        self._bench, self._can_id = bench, can_id

    def send(self, payload: bytes) -> None:
        self._bench.send(self._can_id, payload)


class _Direct:
    """The network while nodes are configured: they answer before `send_message` returns."""

    def __init__(self, bench: FaultBench) -> None:
        self._bench = bench
        self.subscribe, self.unsubscribe = bench.network.subscribe, bench.network.unsubscribe

    def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
        assert not remote
        self._bench.nodes.handle(can_id, bytes(data))
