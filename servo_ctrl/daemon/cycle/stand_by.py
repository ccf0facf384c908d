"""Standing by: which nodes can be used again after a stop, and the error codes of their EMCY frames."""

from collections.abc import Callable, Collection, Sequence

from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.canopen.watch import HeartbeatWatch
from servo_ctrl.daemon.cycle.cycle import Cycle

SWITCH_ON = "see to its supply and its cable; Enable sets it up again once it is heard"
EMCY_BYTES = 8


class Nodes:
    """The nodes of a machine that stands by. `start` commands one to NMT operational.

    It may have left that for an error of communication, and has its configuration then. One that has
    restarted, or whose objects somebody else has written, is booted and configured again. `sender` has the
    node of each input of a cycle.
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
        """Nodes to which another participant has written, and what."""
        self.boot: Callable[[list[int]], None] = lambda _nodes: None
        """Begins to boot nodes; `machine.booted` or `machine.not_booted` is called at its end."""

    def back(self, lost: Collection[int]) -> list[int]:
        """Find the inputs among those given up that come again; they are expected from now on."""
        back = [node for node in lost if self._cycle.responding(node)]
        for node in back:
            self._cycle.expect(node)
        return back

    def give_up(self, place: int) -> None:
        """Note that this input does not come any more."""
        self._watch.give_up(self._sender[place])

    def objection(self, lost: Collection[int]) -> str:
        """Say why nodes can be neither used nor booted, else ""; `lost`: inputs that are given up."""
        for node in (self._sender[place] for place in lost):
            if not self._watch.heard(node):
                return f"{self._names[node]}: its cyclic inputs do not come, and nothing else; {SWITCH_ON}"
        for node in range(self._watch.nodes):
            if silence := self._watch.silence(node):
                return f"{self._names[node]}: {silence}; {SWITCH_ON}"
        unset = self.to_boot(())
        left = [node for node in self._watch.left_operational() if node not in unset]
        for node in left:
            self._start(node)
        if left:
            return f"{self._names[left[0]]}: has left NMT operational and is started again; enable once more"
        return ""

    def to_boot(self, lost: Collection[int]) -> list[int]:
        """Find the nodes to be booted before a drive gets power; `lost`: inputs that are given up."""
        restarted = {node for node in range(self._watch.nodes) if self._watch.restarted(node)}
        return sorted(restarted | self.changed.keys() | {self._sender[place] for place in lost})

    def keeps_position(self, node: int) -> bool:
        """Whether a node that is to be booted has gone on since the last boot, so that its home holds."""
        return node in self.changed and not self._watch.restarted(node)

    def begin_boot(self, nodes: Collection[int]) -> None:
        """Boot these; one that restarts from now on is noticed."""
        for node in nodes:
            self._watch.forget_restart(node)
        self.boot(list(nodes))

    def not_booted(self, nodes: Collection[int]) -> None:
        """Remember that these are to be booted still."""
        for node in nodes:
            self._watch.doubt(node)

    def booted(self, nodes: Collection[int]) -> str:
        """Start nodes that are configured; say which of them has restarted meanwhile, "" where none has."""
        for node in nodes:
            if self._watch.restarted(node):
                return f"{self._names[node]}: restarted while it was configured; check its supply"
        for node in nodes:
            self.changed.pop(node, None)
            self._start(node)
        return ""

    def use(self, nodes: Collection[int]) -> None:
        """Take nodes for operational whose inputs have come since they were started."""
        for node in nodes:
            self._watch.take_for_operational(node)


def keeping_error_code(
    servo: AxisServo, handler: Callable[[bytearray, float], None]
) -> Callable[[bytearray, float], None]:
    """Let the handler of a drive's emergency messages also keep the error code for the status of its axis."""

    def on_emcy(payload: bytearray, timestamp_s: float) -> None:
        if len(payload) == EMCY_BYTES:
            code = int.from_bytes(payload[:2], "little")
            servo.error_code = code if code & 0xFF00 else None
        handler(payload, timestamp_s)

    return on_emcy
