"""Collects figures of the bus: load, heartbeats, emergency messages, and the histogram of cycle times.

Frame handlers count; figures are computed only when a client requests them.
"""

import math
import struct
import time
from collections import deque
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Any

from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.watch import describe_emcy
from servo_ctrl.commands.bus_status import BusStatus, CycleHistogram, EmcyEntry, EventEntry, NodeStatus
from servo_ctrl.commands.local_codec import to_plain
from servo_ctrl.commands.local_messages import plain_json
from servo_ctrl.daemon.cycle.event_log import PUBLISHED
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.page.row_tap import RowTap
from servo_ctrl.io.can_port import CanPort, Handler
from servo_ctrl.telemetry.local_socket.status import BusFigures

RATE_INTERVAL_S = 1.0
"""Interval of bus load and frame rate; chosen."""
EMCY_KEPT = 100
"""Bounds the emergency messages kept; chosen."""
NMT_STATES = {0x00: "booting", 0x04: "stopped", 0x05: "operational", 0x7F: "pre_operational"}
_EMCY = struct.Struct("<HB5x")


class BusWatch:
    """Call `listen` after the handlers of the nodes are registered. `tap` counts the cycles."""

    def __init__(
        self, plans: Sequence[NodePlan], machine: MachineController, tap: RowTap, bit_rate: int = 1_000_000
    ) -> None:
        self._bit_rate = bit_rate
        self._plans, self._machine, self._tap = tuple(plans), machine, tap
        self._port: CanPort | None = None
        self._states = ["unknown"] * len(self._plans)
        self._heartbeat_s = [math.nan] * len(self._plans)
        self._emcy: deque[bytes] = deque(maxlen=EMCY_KEPT)
        """Emergency messages in JSON, each encoded at its arrival so that the cost per tick is bounded."""
        self._events_json = b"[]"
        self._events_count = 0
        self._event_times: deque[str] = deque(maxlen=PUBLISHED)
        """When the events in the log were first seen here, ISO 8601, the newest last."""
        self._missed_before = self._missing_before = 0
        self._sampled_s, self._sampled_cycle = time.monotonic(), 0
        self._frames = self._bits = 0
        self._load = self._frames_per_s = 0.0

    def listen(self, port: CanPort) -> None:
        """Receive heartbeats and emergency messages too, before the handlers registered already."""
        self._port = port
        for node, plan in enumerate(self._plans):
            for base, receive in ((0x700, self._on_heartbeat), (0x080, self._on_emcy)):
                can_id = base + plan.node_id
                port.handlers[can_id] = _before(port.handlers[can_id], node, receive)

    def clear(self) -> None:
        """Reset the counts of cycles, missed ticks and missing inputs."""
        self._tap.clear()
        self._missed_before = self._machine.missed_ticks
        self._missing_before = self._machine.missing_inputs

    def figures(self) -> BusFigures:
        """Return the present figures."""
        now_s = time.monotonic()
        self._sample(now_s)
        bus = BusStatus(
            load=self._load,
            bit_rate=self._bit_rate,
            frames_per_s=self._frames_per_s,
            cycle_us=CycleHistogram(self._tap.edges_us, tuple(self._tap.counts)),
            missed_ticks=self._machine.missed_ticks - self._missed_before,
            missing_inputs=self._machine.missing_inputs - self._missing_before,
        )
        nodes = tuple(
            NodeStatus(plan.key, plan.node_id, state, now_s - heartbeat_s)
            for plan, state, heartbeat_s in zip(self._plans, self._states, self._heartbeat_s, strict=True)
        )
        emcy = b"[%b]" % b",".join(self._emcy)
        return BusFigures(_json(bus), _json(nodes), emcy, self._events())

    def _events(self) -> bytes:
        log = self._machine.events
        if log.count != self._events_count:
            new = min(log.count - self._events_count, PUBLISHED)
            self._event_times.extend([datetime.now(UTC).isoformat(timespec="milliseconds")] * new)
            self._events_count = log.count
            entries = zip(log.newest, self._event_times, strict=True)
            self._events_json = _json(tuple(EventEntry(*event, time) for event, time in entries))
        return self._events_json

    def _sample(self, now_s: float) -> None:
        if self._port is None or now_s - self._sampled_s < RATE_INTERVAL_S:
            return
        # in lockstep the bus runs as fast as it can, so rates refer to the time that SYNC counts
        cycle = self._tap.end
        elapsed_s = (cycle - self._sampled_cycle) * self._tap.period_s or now_s - self._sampled_s
        self._frames_per_s = (self._port.frames - self._frames) / elapsed_s
        self._load = (self._port.bits - self._bits) / elapsed_s / self._bit_rate
        self._sampled_s, self._sampled_cycle = now_s, cycle
        self._frames, self._bits = self._port.frames, self._port.bits

    def _on_heartbeat(self, node: int, payload: bytes) -> None:
        if payload:
            self._states[node] = NMT_STATES.get(payload[0] & 0x7F, "unknown")
            self._heartbeat_s[node] = time.monotonic()

    def _on_emcy(self, node: int, payload: bytes) -> None:
        if len(payload) != _EMCY.size:
            return
        code, register = _EMCY.unpack(payload)
        entry = EmcyEntry(
            time=datetime.now(UTC).isoformat(timespec="milliseconds"),
            node=self._plans[node].key,
            code=code,
            error_register=register,
            text=describe_emcy(code) if code & 0xFF00 else "error reset",
        )
        self._emcy.append(_json(entry))


def _json(value: Any) -> bytes:
    return plain_json(to_plain(value))


def _before(next_handler: Handler, node: int, receive: Callable[[int, bytes], None]) -> Handler:
    """Return a handler that passes a frame to `receive` first, then to `next_handler`."""

    def handler(payload: bytes, timestamp_s: float) -> None:
        receive(node, payload)
        next_handler(payload, timestamp_s)

    return handler
