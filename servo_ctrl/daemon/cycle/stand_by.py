"""Standby: decides which nodes can be used again after a stop, and keeps the error codes of EMCY frames."""

from collections.abc import Callable, Collection, Sequence

from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.canopen.watch import HeartbeatWatch
from servo_ctrl.daemon.cycle.cycle import Cycle

SWITCH_ON = "check its supply and its cable; Enable configures it again once it responds"
EMCY_BYTES = 8


class StandbyNodes:
    """The nodes of a machine that stands by.

    A node that left NMT operational after a communication error kept its configuration: `start` commands it
    to operational. A node that restarted, or whose objects another participant wrote, boots again. `sender`
    gives the node of each input of a cycle.
    """

    def __init__(
        self,
        cycle: Cycle,
        watch: HeartbeatWatch,
        names: Sequence[str],
        start: Callable[[int], None],
        sender: Sequence[int],
    ) -> None:
        self._cycle, self._watch, self._names, self._start = cycle, watch, names, start
        self._sender = tuple(sender)
        self.changed: dict[int, str] = {}
        """Nodes to which another participant has written, and a text about the write."""
        self.boot: Callable[[list[int]], None] = lambda _nodes: None
        """Starts the boot of nodes, which ends with a call of `MachineController.booted`."""

    def returned(self, lost: Collection[int]) -> list[int]:
        """Return which of the inputs given up arrive again; the cycle expects them from now on."""
        returned = [node for node in lost if self._cycle.responding(node)]
        for node in returned:
            self._cycle.expect(node)
        return returned

    def give_up(self, index: int) -> None:
        """Note that the input at `index` was given up."""
        self._watch.give_up(self._sender[index])

    def objection(self, lost: Collection[int]) -> str:
        """Return why nodes can be neither used nor booted, else ""; `lost`: inputs that were given up."""
        for node in (self._sender[index] for index in lost):
            if not self._watch.is_responding(node):
                return f"{self._names[node]}: neither TPDOs nor heartbeats are received; {SWITCH_ON}"
        for node in range(self._watch.nodes):
            if silence := self._watch.silence(node):
                return f"{self._names[node]}: {silence}; {SWITCH_ON}"
        unconfigured = self.to_boot(())
        stopped = [node for node in self._watch.left_operational() if node not in unconfigured]
        for node in stopped:
            self._start(node)
        if stopped:
            return (
                f"{self._names[stopped[0]]}: has left NMT operational and is started again; enable once more"
            )
        return ""

    def to_boot(self, lost: Collection[int]) -> list[int]:
        """Return the nodes that must boot before a drive gets power; `lost`: inputs that were given up."""
        restarted = {node for node in range(self._watch.nodes) if self._watch.restarted(node)}
        return sorted(restarted | self.changed.keys() | {self._sender[index] for index in lost})

    def keeps_position(self, node: int) -> bool:
        """Whether a node that must boot has not restarted since its last boot, so that its home is valid."""
        return node in self.changed and not self._watch.restarted(node)

    def begin_boot(self, nodes: Collection[int]) -> None:
        """Start the boot of these nodes; a restart from now on is detected."""
        for node in nodes:
            self._watch.clear_restart(node)
        self.boot(list(nodes))

    def not_booted(self, nodes: Collection[int]) -> None:
        """Note that these nodes must still boot."""
        for node in nodes:
            self._watch.mark_unconfigured(node)

    def booted(self, nodes: Collection[int]) -> str:
        """Start the configured nodes; if one restarted meanwhile, start none and return which, else ""."""
        for node in nodes:
            if self._watch.restarted(node):
                return f"{self._names[node]}: restarted while it was configured; check its supply"
        for node in nodes:
            self.changed.pop(node, None)
            self._start(node)
        return ""

    def mark_operational(self, nodes: Collection[int]) -> None:
        """Mark these nodes as operational, because their inputs arrived after their start."""
        for node in nodes:
            self._watch.assume_operational(node)


def with_error_code(
    servo: AxisServo, handler: Callable[[bytes, float], None]
) -> Callable[[bytes, float], None]:
    """Wrap the EMCY handler of a drive so that it also keeps the error code for the axis status."""

    def on_emcy(payload: bytes, timestamp_s: float) -> None:
        if len(payload) == EMCY_BYTES:
            code = int.from_bytes(payload[:2], "little")
            servo.error_code = code if code & 0xFF00 else None
        handler(payload, timestamp_s)

    return on_emcy
