"""Standing by: which nodes can be used again after a stop, and what their emergency messages said."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from servo_ctrl.axis.servo import AxisServo
    from servo_ctrl.canopen.watch import HeartbeatWatch
    from servo_ctrl.daemon.cycle import Cycle

END_THE_RUN = "end the run and start it again"
"""Configuring a node takes a boot."""
EMCY_BYTES = 8


def readmission(
    cycle: Cycle, watch: HeartbeatWatch, names: Sequence[str], start: Callable[[int], None]
) -> Callable[[frozenset[int]], str]:
    """For `Machine.readmit`: nodes that answer again, with their configuration, are expected again.

    `start` commands a node to NMT operational, which may have left it for an error of communication.
    """

    def readmit(lost: frozenset[int]) -> str:
        for node, name in enumerate(names):
            if problem := watch.complaint(node):
                return f"{name}: {problem}; {END_THE_RUN}"
        left = watch.left_operational()
        for node in left:
            start(node)
        if left:
            return f"{names[left[0]]}: has left NMT operational and is started again; enable once more"
        for node in lost:
            if not cycle.hears(node):
                return f"{names[node]}: its cyclic inputs do not come; if they stay away, {END_THE_RUN}"
        for node in lost:
            cycle.expect(node)
        return ""

    return readmit


def noting_errors(
    servo: AxisServo, handler: Callable[[bytearray, float], None]
) -> Callable[[bytearray, float], None]:
    """The handler of a drive's emergency messages, with the error code kept for the status of its axis."""

    def on_emcy(payload: bytearray, timestamp_s: float) -> None:
        if len(payload) == EMCY_BYTES:
            code = int.from_bytes(payload[:2], "little")
            servo.error_code = code if code & 0xFF00 else None
        handler(payload, timestamp_s)

    return on_emcy
