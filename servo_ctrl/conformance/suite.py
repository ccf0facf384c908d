"""Run of the suite on one node: every clause once, regardless of the other findings."""

from collections.abc import Iterator
from pathlib import Path

from servo_ctrl.canopen.stack import load_eds
from servo_ctrl.conformance import (  # noqa: F401  # each registers its clauses
    nmt_clauses,
    object_clauses,
    pdo_clauses,
    profile_clauses,
    sdo_clauses,
)
from servo_ctrl.conformance.clauses import CLAUSES, ENTER_PRE_OPERATIONAL, Clause, NodeUnderTest
from servo_ctrl.conformance.dialogue import Dialogue, Failed, NotApplicable, Refused, Wire
from servo_ctrl.conformance.verdicts import ClauseFinding, Verdict


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
