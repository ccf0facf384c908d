"""The daemon's cycle, machine and boot against the simulator's nodes, in one process, without a wall clock.

Frames go from hand to hand in the order of the bus. What a test injects is a fault of `hil_sim.faults`, or a
frame. All is written down by cycle: what the drives were told, what happened, where the table truly was.
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
from hil_sim.runner.bench import Bench
from hil_sim.runner.lockstep import Lockstep
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.canopen.boot import _boot_node
from servo_ctrl.canopen.nmt import NmtCommand, command_nodes
from servo_ctrl.canopen.node import ControllerNode
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.canopen.stack import Network
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.program import program_segments
from servo_ctrl.daemon.run.assemble import assemble, build_axes
from servo_ctrl.daemon.run.own_node import fault_reporter
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.motion.move import Move
from servo_ctrl.recording.channels import AXIS_CHANNELS

BRAKE, POWER_OFF = 0x02, 0x00
"""Controlwords: quick stop, disable voltage."""
FEED_M_S = 0.05
FAR = Move("far", (0.06, 0.04), FEED_M_S, np.inf, trapezoidal=False)
REST_M_S = 1e-3
_import_od = cache(canopen.import_od)
"""Every EDS is parsed once: neither side changes what it has read."""
COLUMN = {channel.name: place for place, channel in enumerate(AXIS_CHANNELS)}
SHARED = 3
"""Columns ahead of those of the axes."""


class FaultBench:
    """A machine directory's table, its daemon in lockstep. `run` moves on; the move begins by itself."""

    def __init__(self, machine_dir: Path, *faults: str, plant: Path | None = None) -> None:
        with patch.object(canopen, "import_od", _import_od):
            self._make(machine_dir, faults, plant)

    def _make(self, machine_dir: Path, faults: tuple[str, ...], plant: Path | None) -> None:
        self.config = load_machine(machine_dir)
        self.controlwords: list[tuple[int, int, int]] = []
        """(cycle, node, controlword) of every RPDO."""
        self.sent: list[tuple[int, int, bytes]] = []
        """(cycle, identifier, data) of what else the daemon sent."""
        self.rows: list[list[float]] = []
        self.events: list[tuple[int, Event]] = []
        """What was noted, by cycle."""
        self.truth_m: list[list[float]] = []
        """Where the tables were, by cycle."""
        self.off = False
        self.listens = True
        """Whether nodes hear the daemon."""
        self.name = "bench"
        self.handlers: dict[int, Callable[[bytearray, float], None]] = {}
        self.on_down: Any = None
        self.on_error_frame: Any = None
        self._wire: deque[tuple[bool, int, bytes]] = deque()
        self.nodes = Bench(
            load_plant(plant or machine_dir), self._from_nodes, None, [read_fault(text) for text in faults]
        )
        Lockstep(self.nodes)
        self.network = Network(self.send)
        self.plans = plan_machine(self.config)
        self._boot()
        node = ControllerNode(self.network, self.config, FakeCommandHandler())
        node.boot_up()
        report = fault_reporter(node)
        self.machine, self.cycle = assemble(
            self.config,
            self.plans,
            build_axes(self.config, self.plans),
            self,  # type: ignore[arg-type]  # as far as a port is asked for
            node,
            lockstep=True,
            record=self.rows.append,
            on_ready=self._move,
            on_rest=lambda: None,
            on_stop=lambda _text: None,
            on_end=self._on_end,
            on_fault=report,
        )
        self._note_events()
        command_nodes(self.network, self.plans, NmtCommand.START)
        node.operational(running=True)

    # --- what a port is asked for -----------------------------------------------------------------

    def frame(self, can_id: int, _size: int) -> _Frame:
        return _Frame(self, can_id)

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
        """So many cycles, fewer where the machine goes off; stops behind the inputs of the last."""
        last = self.cycle.number + cycles
        if self.cycle.number < 0:
            self.cycle.begin()
        while not self.off and self.cycle.number <= last:
            if not self._wire:
                self.cycle.complete_without()
            while self._wire and not (self._wire[0][:2] == (True, 0x080) and self.cycle.number > last):
                self._deliver(*self._wire.popleft())
        return self

    def inject(self, can_id: int, payload: bytes) -> int:
        """A frame of somebody else, ahead of the next SYNC; the cycle it falls into."""
        self._wire.appendleft((False, can_id, payload))
        self.nodes.handle(can_id, payload)
        return self.cycle.number

    def noted(self, event: Event) -> int:
        """The cycle in which it happened first."""
        return next(cycle for cycle, found in self.events if found is event)

    def reacted(self, node: int, controlword: int) -> int:
        """The first cycle, once the axes moved, whose RPDO told a drive this."""
        moved = self.moving[0]
        return next(
            c for c, target, word in self.controlwords if (target, word) == (node, controlword) and c > moved
        )

    @property
    def moving(self) -> list[int]:
        """Cycles in which the set points moved."""
        column = SHARED + COLUMN["velocity_command_m_s"]
        return [int(row[1]) for row in self.rows if abs(row[column]) > 0.0]

    def ramp(self) -> int:
        """The first cycle in which the set points got slower."""
        column = SHARED + COLUMN["velocity_command_m_s"]
        speeds = [(int(row[1]), abs(row[column])) for row in self.rows]
        moving = [(cycle, speed) for cycle, speed in speeds if cycle >= self.moving[0]]
        return next(b[0] for a, b in itertools.pairwise(moving) if b[1] < a[1] * (1.0 - 1e-9))

    def at_rest(self, axis: int, over: int = 20) -> bool:
        """Whether the table hardly moved in the last cycles; without power its presliding still relaxes."""
        last = [at[axis] for at in self.truth_m[-over:]]
        return max(last) - min(last) < over * 1e-3 * REST_M_S

    def emcy(self) -> list[int]:
        """Error codes that our node has told."""
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

    def _deliver(self, to_nodes: bool, can_id: int, payload: bytes) -> None:
        if not to_nodes:
            handler = self.handlers.get(can_id)
            if handler is not None:
                handler(bytearray(payload), 0.0)
            else:
                self.network.notify(can_id, bytearray(payload), 0.0)
        elif self.listens:
            self.nodes.handle(can_id, payload)
            if can_id == 0x080:
                self.truth_m.append(self.nodes.plant.state["table_position_m"].tolist())

    def _move(self) -> None:
        segments = program_segments([FAR], self.config, self.machine.set_points_m())
        self.machine.run(ProgramReference(segments))

    def _on_end(self) -> None:
        self.off = True

    def _note_events(self) -> None:
        take = self.machine._incidents.take

        def taken(stage: Stage, event: Event, text: str, cycle: int) -> Any:
            self.events.append((self.cycle.number, event))
            return take(stage, event, text, cycle)

        self.machine._incidents.take = taken  # type: ignore[method-assign]  # and then as it was


class _Frame:
    def __init__(self, bench: FaultBench, can_id: int) -> None:
        self._bench, self._can_id = bench, can_id

    def send(self, payload: bytes) -> None:
        self._bench.send(self._can_id, payload)


class _Direct:
    """The network while the nodes are configured: what is sent is answered before `send_message` returns."""

    def __init__(self, bench: FaultBench) -> None:
        self._bench = bench
        self.subscribe, self.unsubscribe = bench.network.subscribe, bench.network.unsubscribe

    def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
        assert not remote
        self._bench.nodes.handle(can_id, bytes(data))
