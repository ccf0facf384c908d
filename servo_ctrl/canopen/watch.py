"""What nodes say unasked: heartbeats, counted in cycles, and emergency messages, in words."""

import struct
from collections.abc import Callable, Sequence

from servo_ctrl.canopen.plan import NodePlan
from servo_ctrl.canopen.settings import HEARTBEATS_MISSED

NMT_BOOT_UP = 0x00
NMT_OPERATIONAL = 0x05
RESTARTED = "has restarted, its configuration is gone"
_EMCY = struct.Struct("<HB5s")

EMCY_TEXTS: tuple[tuple[int, int, str], ...] = (
    (0xFFFF, 0x2310, "continuous over-current"),
    (0xFFFF, 0x2320, "short circuit"),
    (0xFFFF, 0x3210, "DC link over-voltage"),
    (0xFFFF, 0x3220, "DC link under-voltage"),
    (0xFFFF, 0x4210, "device over-temperature"),
    (0xFFFF, 0x7320, "position sensor"),
    (0xFFFF, 0x8110, "CAN overrun, objects lost"),
    (0xFFFF, 0x8120, "CAN error passive"),
    (0xFFFF, 0x8130, "it misses a heartbeat"),
    (0xFFFF, 0x8140, "recovered from bus-off"),
    (0xFFFF, 0x8150, "COB-ID collision"),
    (0xFFFF, 0x8210, "PDO too short"),
    (0xFFFF, 0x8220, "PDO too long"),
    (0xFFFF, 0x8240, "SYNC of unexpected length"),
    (0xFFFF, 0x8250, "it misses an RPDO"),
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
"""(mask, value, text), the particular before the general; CiA 301 and 402 error codes."""


def describe_emcy(code: int) -> str:
    """An emergency error code in words."""
    return next((text for mask, value, text in EMCY_TEXTS if code & mask == value), "error")


def emcy_handler(plan: NodePlan, report: Callable[[str], None]) -> Callable[[bytearray, float], None]:
    """A handler for the node's EMCY frames; "error reset" (00xxh) is good news and not reported."""

    def on_emcy(payload: bytearray, _timestamp_s: float) -> None:
        if len(payload) != _EMCY.size:
            report(f"{plan.key} (node {plan.node_id}): an EMCY frame of {len(payload)} bytes")
            return
        code, register, _detail = _EMCY.unpack(payload)
        if code & 0xFF00:
            text = describe_emcy(code)
            report(
                f"{plan.key} (node {plan.node_id}): EMCY {code:04X}h, {text} (error register {register:02X}h)"
            )

    return on_emcy


class HeartbeatWatch:
    """Consumer heartbeat of all nodes, in SYNC cycles, so that simulated time counts in lockstep.

    A boot-up message is told to `on_restart` as it comes: the node has forgotten its configuration.
    """

    def __init__(
        self, plans: Sequence[NodePlan], heartbeat_cycles: int, on_restart: Callable[[str], None]
    ) -> None:
        self._plans = tuple(plans)
        self._limit = heartbeat_cycles * HEARTBEATS_MISSED
        self._grace = heartbeat_cycles
        self._seen = [0] * len(self._plans)
        self._operational = [True] * len(self._plans)
        self._restarted = [False] * len(self._plans)
        self._silent = [False] * len(self._plans)
        """Told already."""
        self._next_check = heartbeat_cycles
        self._on_restart = on_restart
        self.cycle = 0
        """The cycle that arriving heartbeats belong to."""

    def handler(self, node: int) -> Callable[[bytearray, float], None]:
        """A handler for the heartbeats (700h + id) of the node at this place among the plans."""

        def on_heartbeat(payload: bytearray, _timestamp_s: float) -> None:
            self._seen[node] = self.cycle
            self._silent[node] = False
            if payload:
                state = payload[0] & 0x7F
                self._operational[node] = state == NMT_OPERATIONAL
                if state == NMT_BOOT_UP:
                    self._restarted[node] = True
                    self._on_restart(f"{self._name(node)}: {RESTARTED}")

        return on_heartbeat

    def complaint(self, node: int) -> str:
        """Why a node cannot be used any more, "" when it can."""
        if self._restarted[node]:
            return RESTARTED
        if self._grace and self.cycle - self._seen[node] > self._limit:
            return f"no heartbeat in {self.cycle - self._seen[node]} cycles"
        return ""

    def left_operational(self) -> list[int]:
        """The nodes whose heartbeats tell another NMT state."""
        return [node for node, operational in enumerate(self._operational) if not operational]

    def advance(self, cycle: int) -> list[str]:
        """Complaints at this cycle; mostly none, for one heartbeat time passes between two looks.

        Silence is complained about once.

        None at all where no heartbeats were asked for (`heartbeat_cycles` 0).
        """
        self.cycle = cycle
        if cycle < self._next_check or not self._grace:
            return []
        self._next_check = cycle + self._grace
        return [text for node in range(len(self._plans)) if (text := self._judge(node, cycle))]

    def _judge(self, node: int, cycle: int) -> str:
        if cycle - self._seen[node] > self._limit:
            if self._silent[node]:
                return ""
            self._silent[node] = True
            return f"{self._name(node)}: no heartbeat in {cycle - self._seen[node]} cycles"
        if not self._operational[node] and cycle > self._grace:
            return f"{self._name(node)}: has left NMT operational"
        return ""

    def _name(self, node: int) -> str:
        return f"{self._plans[node].key} (node {self._plans[node].node_id})"
