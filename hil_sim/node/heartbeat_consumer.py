"""Heartbeat consumer 1016h: watches other nodes, each from its first heartbeat on."""

from collections.abc import Callable

from hil_sim.node.dictionary import Dictionary
from hil_sim.node.nmt import NEVER_US, Clock
from hil_sim.node.sdo_abort import AbortCode, SdoAbort


class HeartbeatConsumer:
    """Calls `on_lost(node_id)` once when a heartbeat is overdue, `on_recovered()` once all have returned."""

    def __init__(
        self,
        dictionary: Dictionary,
        clock: Clock,
        on_lost: Callable[[int], None],
        on_recovered: Callable[[], None],
    ) -> None:
        self._dictionary = dictionary
        self._clock = clock
        self._on_lost = on_lost
        self._on_recovered = on_recovered
        self._periods_us: dict[int, int] = {}
        self._deadlines_us: dict[int, int] = {}  # of the nodes that have sent one
        self._lost: set[int] = set()
        self.due_us = NEVER_US
        dictionary.checks[0x1016] = self._check
        self.follow()

    @property
    def watched(self) -> list[int]:
        """Nodes whose heartbeats are to be passed to `on_heartbeat`."""
        return list(self._periods_us)

    def follow(self) -> None:
        """Apply the entries of 1016h; a node that was watched before keeps its deadline."""
        entries = self._entries().values()
        self._periods_us = {node: 1000 * ms for node, ms in entries if 1 <= node <= 127 and ms}
        self._deadlines_us = {
            node: deadline for node, deadline in self._deadlines_us.items() if node in self._periods_us
        }
        self._mark_recovered(self._lost - self._periods_us.keys())
        self._update()

    def on_heartbeat(self, node: int) -> None:
        """Restart the deadline of `node`, whose heartbeat was received."""
        period_us = self._periods_us.get(node)
        if period_us is not None:
            self._mark_recovered({node})
            self._deadlines_us[node] = self._clock.now_us + period_us
            self._update()

    def run(self) -> None:
        """Report the nodes that are overdue."""
        now_us = self._clock.now_us
        lost = [node for node, deadline in self._deadlines_us.items() if now_us >= deadline]
        for node in lost:
            del self._deadlines_us[node]
        self._lost.update(lost)
        self._update()
        for node in lost:
            self._on_lost(node)

    def _mark_recovered(self, nodes: set[int]) -> None:
        if self._lost & nodes:
            self._lost -= nodes
            if not self._lost:
                self._on_recovered()

    def _update(self) -> None:
        self.due_us = min(self._deadlines_us.values(), default=NEVER_US)

    def _entries(self) -> dict[int, tuple[int, int]]:
        """Return node and heartbeat time (ms) of each entry of 1016h, by subindex."""
        count = self._dictionary.value(0x1016, 0)
        return {sub: _decoded(self._dictionary.value(0x1016, sub)) for sub in range(1, count + 1)}

    def _check(self, subindex: int, value: int) -> None:
        """Refuse to watch a node twice."""
        node, period_ms = _decoded(value)
        others = [entry for sub, entry in self._entries().items() if sub != subindex]
        if node and period_ms and any(other == node and ms for other, ms in others):
            raise SdoAbort(AbortCode.PARAMETER_INCOMPATIBLE)


def _decoded(entry: int) -> tuple[int, int]:
    return entry >> 16 & 0xFF, entry & 0xFFFF
