"""Standing by: which nodes can be used again after a stop, and the error codes of their EMCY frames."""

from collections.abc import Callable, Collection, Sequence

from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.canopen.watch import HeartbeatWatch
from servo_ctrl.daemon.cycle.cycle import Cycle

END_THE_RUN = "end the run and start it again"
"""Configuring a node takes a boot."""
EMCY_BYTES = 8


class Nodes:
    """The nodes of a machine that stands by. `start` commands one to NMT operational.

    It may have left that for an error of communication, and has its configuration then.
    """

    def __init__(
        self, cycle: Cycle, watch: HeartbeatWatch, names: Sequence[str], start: Callable[[int], None]
    ) -> None:
        self._cycle, self._watch, self._names, self._start = cycle, watch, names, start
        self.changed: dict[int, str] = {}
        """Nodes to which another participant has written, and what."""

    def back(self, lost: Collection[int]) -> list[int]:
        """Find the nodes among those given up that respond again; they are expected from now on."""
        back = [node for node in lost if self._cycle.responding(node)]
        for node in back:
            self._cycle.expect(node)
        return back

    def objection(self, lost: Collection[int]) -> str:
        """Say why the drives cannot be switched on, "" when they can; `lost`: nodes that are given up."""
        for node, name in enumerate(self._names):
            if problem := self._watch.complaint(node):
                return f"{name}: {problem}; {END_THE_RUN}"
        if self.changed:
            return f"{next(iter(self.changed.values()))}; {END_THE_RUN}"
        left = self._watch.left_operational()
        for node in left:
            self._start(node)
        if left:
            return f"{self._names[left[0]]}: has left NMT operational and is started again; enable once more"
        if lost:
            name = self._names[min(lost)]
            return f"{name}: its cyclic inputs do not come; if they stay away, {END_THE_RUN}"
        return ""


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
