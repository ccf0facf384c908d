"""A run with two faults: seen as one with the first, as one with the second, and with what both may do."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from tests.campaigns.campaign.causes import TPDO
from tests.campaigns.campaign.fault_context import SILENCED
from tests.campaigns.campaign.oracles_reaction import wanted
from tests.campaigns.campaign.run import SILENCING

if TYPE_CHECKING:
    from tests.campaigns.campaign.run import Evidence


class Views(NamedTuple):
    """`first` is None where the second fault has made an end before the first was to be answered.

    `second` is None without one, and where nothing of ours reaches the bus behind the first.
    """

    first: Evidence | None
    second: Evidence | None
    both: Evidence


def views(evidence: Evidence) -> Views:
    """Of a run with one fault all the same."""
    plan, second = evidence.plan, evidence.second
    if plan.second is None or second is None:
        return Views(evidence, None, evidence)
    other = evidence._replace(
        plan=plan._replace(fault=plan.second),
        happened=second.happened,
        axis=second.axis,
        node=second.node,
        notes=tuple(second.notes.items()),
    )
    both = _both(evidence, other)
    if other.axis == evidence.axis:  # the first to show is reported, and ends the search
        evidence, other = _reported_as_either(evidence, other), _reported_as_either(other, evidence)
    ended = bool(plan.second.kills) or plan.second.event in SILENCED
    first = None if ended or _silenced(evidence, other) else evidence
    return Views(first, None if plan.fault.event in SILENCED else other, both)


def _silenced(evidence: Evidence, other: Evidence) -> bool:
    """Whether a node has died before it could send the frames that show the first fault."""
    assert evidence.happened is not None
    assert other.happened is not None
    if other.plan.fault.name == "node restarts" and other.node == evidence.node:
        between = evidence.frames[evidence.happened[0] : other.happened[0]]
        return not any(frame.can_id == TPDO + evidence.node for frame in between)
    silent = other.plan.fault.name in SILENCING and other.axis == evidence.axis
    return silent and other.happened[1] <= evidence.happened[1] + 1


def _reported_as_either(evidence: Evidence, other: Evidence) -> Evidence:
    fault, words = evidence.plan.fault, other.plan.fault.words
    if not (fault.words and words and fault.physical and other.plan.fault.physical):
        return evidence
    return evidence._replace(plan=evidence.plan._replace(fault=fault._replace(words=fault.words + words)))


def _both(evidence: Evidence, other: Evidence) -> Evidence:
    """What the one may do and what the other may do."""
    one, two = evidence.plan.fault, other.plan.fault
    either = one._replace(
        event=one.event or two.event,
        blind_s=one.blind_s + two.blind_s,
        kills=one.kills or two.kills,
        physical=True,
        may_stop=one.may_stop or two.may_stop,
        coasts=one.coasts or two.coasts or "disable" in {wanted(evidence), wanted(other)},
        knocks=one.knocks or two.knocks,
        distorts=one.distorts or two.distorts,
        words=(),
    )
    return evidence._replace(plan=evidence.plan._replace(fault=either))
