"""Run of the suite on one node: every clause once, regardless of the other findings."""

import asyncio
import contextlib
import queue
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

from servo_ctrl.canopen.stack import load_eds
from servo_ctrl.conformance import nmt_clauses, object_clauses, pdo_clauses, profile_clauses, sdo_clauses  # noqa: F401  # each registers its clauses
from servo_ctrl.conformance.clauses import CLAUSES, ENTER_PRE_OPERATIONAL, Clause, NodeUnderTest
from servo_ctrl.conformance.dialogue import Dialogue, Failed, NotApplicable, Refused, Wire
from servo_ctrl.conformance.verdicts import ClauseFinding, Verdict
from servo_ctrl.io.can_port import CanPort, open_port


def examine(wire: Wire, node_id: int, eds: Path) -> Iterator[ClauseFinding]:
    """Yield one finding per clause. Raises EdsError for an EDS that cannot be read."""
    node = NodeUnderTest(Dialogue(wire, node_id), load_eds(eds, node_id))
    node.dialogue.command(ENTER_PRE_OPERATIONAL)
    return (_finding(clause, node) for clause in CLAUSES)


def _finding(clause: Clause, node: NodeUnderTest) -> ClauseFinding:
    verdict, reason = Verdict.PASS, ""
    try:
        clause.check(node)
    except NotApplicable as absent:
        verdict, reason = Verdict.NOT_APPLICABLE, str(absent)
    except (Failed, Refused) as failed:
        verdict, reason = Verdict.FAIL, str(failed)
    return ClauseFinding(clause.number, clause.title, verdict, reason)


class BusWire:
    """A bus for a worker thread: the event loop reads the frames of `port`, the thread takes them here."""

    def __init__(self, port: CanPort) -> None:
        self.send = port.send
        self._frames: queue.SimpleQueue[tuple[int, bytes]] = queue.SimpleQueue()
        port.fallback = lambda can_id, payload, _timestamp_s: self._frames.put((can_id, bytes(payload)))

    def receive(self, timeout_s: float) -> tuple[int, bytes] | None:
        """Return the next frame; None when none arrives in time."""
        try:
            return self._frames.get(timeout=timeout_s) if timeout_s > 0.0 else self._frames.get_nowait()
        except queue.Empty:
            return None


@contextlib.asynccontextmanager
async def bus_wire(bus: str) -> AsyncIterator[BusWire]:
    """Open a bus for the duration of the context. Raises BusError."""
    port = open_port(bus)
    try:
        port.attach(asyncio.get_running_loop())
        yield BusWire(port)
    finally:
        port.close()
