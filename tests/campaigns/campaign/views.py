"""Splits the evidence of a run with two faults: for the first, for the second, and for both together."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from tests.campaigns.campaign.causes import TPDO
from tests.campaigns.campaign.fault_context import SILENCING_EVENTS
from tests.campaigns.campaign.oracles_reaction import required_reaction
from tests.campaigns.campaign.run import SILENCING_FAULTS

if TYPE_CHECKING:
    from tests.campaigns.campaign.run import Evidence


class Views(NamedTuple):
    """The evidence for each fault. `first` is None if the second fault ended the run before its reaction.

    `second` is None without one, and if no frame of the controller reaches the bus after the first.
    """

    first: Evidence | None
    second: Evidence | None
    both: Evidence


def views(evidence: Evidence) -> Views:
    """Return the views of a run; all are equal with one fault."""
    plan, second = evidence.plan, evidence.second
    if plan.second is None or second is None:
        return Views(evidence, None, evidence)
    other = evidence._replace(
        plan=plan._replace(fault=plan.second),
        injected=second.injected,
        axis=second.axis,
        node=second.node,
        notes=tuple(second.notes.items()),
    )
    both = _both(evidence, other)
    if other.axis == evidence.axis:  # the first detected fault is reported, and ends the detection
        evidence, other = _reported_as_either(evidence, other), _reported_as_either(other, evidence)
    second_ends_first = bool(plan.second.kills) or plan.second.event in SILENCING_EVENTS
    first = None if second_ends_first or _silenced(evidence, other) else evidence
    return Views(first, None if plan.fault.event in SILENCING_EVENTS else other, both)


def _silenced(evidence: Evidence, other: Evidence) -> bool:
    """Return whether a node failed before it could send the frames that show the first fault."""
    assert evidence.injected is not None
    assert other.injected is not None
    if other.plan.fault.name == "node restarts" and other.node == evidence.node:
        between = evidence.frames[evidence.injected.frame_index : other.injected.frame_index]
        return not any(frame.can_id == TPDO + evidence.node for frame in between)
    silences = other.plan.fault.name in SILENCING_FAULTS and other.axis == evidence.axis
    return silences and other.injected.cycle <= evidence.injected.cycle + 1


def _reported_as_either(evidence: Evidence, other: Evidence) -> Evidence:
    fault, words = evidence.plan.fault, other.plan.fault.words
    if not (fault.words and words and fault.physical and other.plan.fault.physical):
        return evidence
    return evidence._replace(plan=evidence.plan._replace(fault=fault._replace(words=fault.words + words)))


def _both(evidence: Evidence, other: Evidence) -> Evidence:
    """Return the evidence with the permitted effects of both faults."""
    one, two = evidence.plan.fault, other.plan.fault
    combined = one._replace(
        event=one.event or two.event,
        blind_s=one.blind_s + two.blind_s,
        kills=one.kills or two.kills,
        physical=True,
        may_stop=one.may_stop or two.may_stop,
        coasts=one.coasts
        or two.coasts
        or "disable" in {required_reaction(evidence), required_reaction(other)},
        knocks=one.knocks or two.knocks,
        changes_frames=one.changes_frames or two.changes_frames,
        words=(),
    )
    return evidence._replace(plan=evidence.plan._replace(fault=combined))
