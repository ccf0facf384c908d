"""Consumer heartbeat of the nodes, timed in SYNC cycles, and texts for their emergency messages."""

import struct
from collections.abc import Callable, Sequence

from servo_ctrl.canopen.nmt import NmtState
from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.settings import HEARTBEATS_MISSED

RESTARTED = "has restarted, its configuration is gone"
EMCY_FRAME = struct.Struct("<HB5x")
"""Error code and error register of an EMCY frame (CiA 301)."""

EMCY_TEXTS: tuple[tuple[int, int, str], ...] = (
    (0xFFFF, 0x2310, "continuous over-current"),
    (0xFFFF, 0x2320, "short circuit"),
    (0xFFFF, 0x3210, "DC link over-voltage"),
    (0xFFFF, 0x3220, "DC link under-voltage"),
    (0xFFFF, 0x4210, "device over-temperature"),
    (0xFFFF, 0x7320, "position sensor"),
    (0xFFFF, 0x8110, "CAN overrun, objects lost"),
    (0xFFFF, 0x8120, "CAN error passive"),
    (0xFFFF, 0x8130, "heartbeat error"),
    (0xFFFF, 0x8140, "recovered from bus off"),
    (0xFFFF, 0x8150, "COB-ID collision"),
    (0xFFFF, 0x8210, "PDO not processed due to length error"),
    (0xFFFF, 0x8220, "PDO length exceeded"),
    (0xFFFF, 0x8240, "unexpected SYNC data length"),
    (0xFFFF, 0x8250, "RPDO timeout"),
    (0xFFFF, 0x8611, "following error"),
    (0xF000, 0x2000, "current"),
    (0xF000, 0x3000, "voltage"),
    (0xF000, 0x4000, "temperature"),
    (0xF000, 0x5000, "device hardware"),
    (0xF000, 0x6000, "device software"),
    (0xF000, 0x7000, "additional modules"),
    (0xF000, 0x8000, "monitoring"),
    (0xFF00, 0xFF00, "manufacturer specific"),
)
"""(mask, value, text) of the error codes of CiA 301 and 402; specific codes before general ones."""


def describe_emcy(code: int) -> str:
    """Return the text for an emergency error code."""
    return next((text for mask, value, text in EMCY_TEXTS if code & mask == value), "error")


def emcy_handler(plan: NodePlan, report: Callable[[str], None]) -> Callable[[bytes, float], None]:
    """Make a handler for the node's EMCY frames; "error reset" (00xxh) is not reported."""

    def on_emcy(payload: bytes, _timestamp_s: float) -> None:
        if len(payload) != EMCY_FRAME.size:
            report(f"{plan.name}: an EMCY frame of {len(payload)} bytes")
            return
        code, register = EMCY_FRAME.unpack(payload)
        if code & 0xFF00:
            text = describe_emcy(code)
            report(f"{plan.name}: EMCY {code:04X}h, {text} (error register {register:02X}h)")

    return on_emcy


class HeartbeatWatch:
    """Consumer heartbeat of all nodes, timed in SYNC cycles, so that lockstep keeps simulated time.

    `heartbeat_cycles`: producer heartbeat time of the nodes, 0: none. `on_restart` is called at each boot-up
    message: the node has lost its configuration.
    """

    def __init__(
        self, plans: Sequence[NodePlan], heartbeat_cycles: int, on_restart: Callable[[str], None]
    ) -> None:
        self._names = [plan.name for plan in plans]
        self.nodes = len(plans)
        self._period, self._limit = heartbeat_cycles, heartbeat_cycles * HEARTBEATS_MISSED
        self._last_heartbeat = [0] * len(plans)
        """Cycle of the last heartbeat of each node."""
        self._states = [NmtState.OPERATIONAL.value] * len(plans)
        self._restarted = [False] * len(plans)
        self._responding = [True] * len(plans)
        """Whether each node has sent a heartbeat since `give_up`."""
        self._reported = [False] * len(plans)
        """Whether the silence of each node was reported."""
        self._next_check = heartbeat_cycles
        self._on_restart = on_restart
        self.cycle = 0
        """SYNC cycle to which arriving heartbeats belong."""

    def handler(self, node: int) -> Callable[[bytes, float], None]:
        """Make a handler for the heartbeats (700h + id) of the node with this index among the plans."""

        def on_heartbeat(payload: bytes, _timestamp_s: float) -> None:
            self._last_heartbeat[node], self._reported[node], self._responding[node] = self.cycle, False, True
            if payload:
                self._states[node] = payload[0] & 0x7F
                if self._states[node] == NmtState.INITIALISING:
                    self._restarted[node] = True
                    self._on_restart(f"{self._names[node]}: {RESTARTED}")

        return on_heartbeat

    def restarted(self, node: int) -> bool:
        """Whether a node has sent its boot-up message: its configuration is gone."""
        return self._restarted[node]

    def give_up(self, node: int) -> None:
        """Note that the inputs of a node no longer arrive."""
        self._responding[node] = False

    def is_responding(self, node: int) -> bool:
        """Whether a node has restarted, or sent a heartbeat, since it was given up."""
        return self._responding[node] or self._restarted[node]

    def mark_unconfigured(self, node: int) -> None:
        """Treat a node that could not be configured as restarted, until it is configured."""
        self._restarted[node] = True

    def clear_restart(self, node: int) -> None:
        """Forget restarts before now: the node is being configured."""
        self._restarted[node] = False

    def assume_operational(self, node: int) -> None:
        """Treat a node as operational: it was started and responds, so earlier heartbeats are outdated."""
        self._last_heartbeat[node], self._reported[node] = self.cycle, False
        self._states[node] = NmtState.OPERATIONAL

    def left_operational(self) -> list[int]:
        """Indices of the nodes whose last heartbeat has another NMT state."""
        return [node for node, state in enumerate(self._states) if state != NmtState.OPERATIONAL]

    def advance(self, cycle: int) -> list[str]:
        """Return the problems at this cycle, checked once per heartbeat time; silence is reported once."""
        self.cycle = cycle
        if cycle < self._next_check or not self._period:
            return []
        self._next_check = cycle + self._period
        problems = []
        for node, name in enumerate(self._names):
            if silence := self.silence(node):
                if not self._reported[node]:
                    problems.append(f"{name}: {silence}")
                self._reported[node] = True
            elif self._states[node] != NmtState.OPERATIONAL and cycle > self._period:
                problems.append(f"{name}: has left NMT operational")
        return problems

    def silence(self, node: int) -> str:
        """Text about a missing heartbeat of a node; "" if it is not overdue."""
        silent = self.cycle - self._last_heartbeat[node]
        return f"no heartbeat in {silent} cycles" if self._period and silent > self._limit else ""
