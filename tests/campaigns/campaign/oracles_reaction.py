"""What must hold of reactions: as frames on the bus show them, against the fault policy's page."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tests.campaigns.campaign import spec
from tests.campaigns.campaign.fault_context import DRIVES, LOCKSTEP, SILENCED
from tests.campaigns.campaign.wire import CONTROLLER, NMT, SYNC

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.campaigns.campaign.run import Evidence
    from tests.campaigns.campaign.wire import Frame

OUR_EMCY = 0x0FF
LEAVE = (b"\x02", b"\x80")
"""Stop, enter pre-operational: a drive that leaves operational brakes by itself (6007h)."""
ENABLED = 0x0F
ALONE_CYCLES = 3 * spec.HEARTBEAT_CYCLES + 12
"""1016h: three of our heartbeats; and how seldom the simulator looks where no SYNC comes."""
TURNS_CYCLES = 80
"""Between an exception and the end of the cycle lockstep makes some turns of the loop, 64 frames each."""
RAMP_CYCLES = 60
"""A controlled stop from the highest speed of the campaign at the acceleration limit, and power off."""
REQUESTS = {"stop signal", "switched off"}
"""They send no EMCY: the bus shows only that power goes off."""
STARTING = 1
LAST = 10**9
ORDERS = (0x200 + DRIVES[0], 0x200 + DRIVES[1])


class Reaction(NamedTuple):
    """What was seen of it: cycles from the fault on, and how many are allowed."""

    cycles: int
    bound: int


def orders(evidence: Evidence) -> Iterator[tuple[int, Frame, bool]]:
    """(place, frame, whether it keeps its drive in operation) of the controller's RPDOs."""
    for place, frame in enumerate(evidence.frames):
        if frame.can_id in ORDERS and frame.sender is CONTROLLER and len(frame.data) >= 2:
            yield place, frame, frame.data[0] & ENABLED == ENABLED


def first_reaction(evidence: Evidence) -> int | None:
    """Cycle of the first frame of a reaction: our EMCY, or what takes a drive out of operation."""
    if evidence.happened is None:
        return None
    begun, until = evidence.happened[0], _on_again(evidence)
    led = dict.fromkeys(ORDERS, False)
    released: int | None = None
    for place, frame, enabling in orders(evidence):
        if place >= begun and led[frame.can_id] and not enabling:
            released = frame.cycle
            break
        led[frame.can_id] = enabling
    reported = emcy_cycle(evidence, len(evidence.frames))
    ours = (f for f in evidence.frames[begun:] if f.can_id == NMT and f.sender is CONTROLLER)
    left = next((frame.cycle for frame in ours if frame.data[:1] in LEAVE), None)
    return min(
        (cycle for cycle in (released, reported, left) if cycle is not None and cycle <= until), default=None
    )


def _on_again(evidence: Evidence) -> int:
    """Cycle in which the drives are switched on once more: what comes then is none of the reaction."""
    assert evidence.happened is not None
    behind = (at for at, stage in evidence.stages if stage == STARTING and at > evidence.happened[1] + 1)
    return next(behind, LAST)


def wanted(evidence: Evidence) -> str:
    """What the documents want: a reaction, or "" where the machine goes on."""
    fault = evidence.plan.fault
    if evidence.happened is None or fault.event is None:
        return ""
    stage = evidence.happened[3].name.lower().replace("_", " ")
    return spec.reactions()[fault.event][stage]


def reaction(evidence: Evidence) -> tuple[Reaction | None, list[str]]:
    """The reaction and its bound; None where there is to be none, or nothing to see of it."""
    if evidence.plan.fault.kills in {"controller", "task"}:
        return alone(evidence)
    if evidence.plan.fault.event == "bus off" and wanted(evidence):
        return alone(evidence)  # nothing at all is sent
    seen, problems = answered(evidence)
    if evidence.plan.fault.event in SILENCED and wanted(evidence):
        orphaned, more = alone(evidence)  # what was sent has not arrived: drives stop by themselves
        return seen or orphaned, problems + more
    return seen, problems


def answered(evidence: Evidence) -> tuple[Reaction | None, list[str]]:
    """The reaction as the bus shows it."""
    word = wanted(evidence)
    if not word or evidence.happened is None or evidence.plan.fault.event is None:
        return None, []
    fault = evidence.plan.fault
    due = _due(evidence)
    if due is None:
        return _unforced(evidence), []
    since, bound = due
    if word == "hold" and fault.event in REQUESTS:
        bound += RAMP_CYCLES
    if fault.event in REQUESTS and not _powered(evidence):
        return None, _ends(evidence, bound)  # the drives were off before and stay so
    cycle = first_reaction(evidence)
    if cycle is None:
        if not _powered(evidence, 1) or word == "disable":
            return None, _ends(evidence, bound)
        return None, [f"{word} wanted, and nothing of it seen on the bus"]
    seen = Reaction(cycle - since, bound)
    return seen, [f"{word} after {seen.cycles} cycles, {bound} allowed"] if seen.cycles > bound else []


def _due(evidence: Evidence) -> tuple[int, int] | None:
    """Since which cycle there is something to be seen, and the cycles allowed; None: there never was."""
    assert evidence.happened is not None
    fault = evidence.plan.fault
    assert fault.event is not None
    bounds = spec.bounds(lockstep=evidence.plan.pacing == LOCKSTEP)
    if fault.cause is None:
        return evidence.happened[1], max(bounds[event].cycles for event in (fault.event, *fault.also))
    times = [(cause.cycle, bounds[cause.event].cycles) for cause in fault.cause(evidence)]
    return min(times, key=sum, default=None)


def _unforced(evidence: Evidence) -> Reaction | None:
    """Return a reaction in time where the machine reported the fault before it had to."""
    fault = evidence.plan.fault
    assert fault.event is not None
    if emcy_cycle(evidence, evidence.frames_before_stop) is None:
        return None
    return Reaction(0, spec.bounds(lockstep=evidence.plan.pacing == LOCKSTEP)[fault.event].cycles)


def emcy_cycle(evidence: Evidence, until: int | None) -> int | None:
    """Cycle of our first emergency message behind the fault, up to this place among the frames."""
    assert evidence.happened is not None
    behind = evidence.frames[evidence.happened[0] : until]
    return next((f.cycle for f in behind if f.can_id == OUR_EMCY and f.data[:2] != bytes(2)), None)


def alone(evidence: Evidence) -> tuple[Reaction | None, list[str]]:
    """Drives without a controller: none is in operation any more once our heartbeats have been missed."""
    killed = evidence.plan.fault.kills == "controller"
    if evidence.happened is None or (killed and evidence.killed_cycle is None):
        return None, []
    since = evidence.killed_cycle if killed else evidence.happened[1]
    truth = evidence.truth
    behind = truth.cycle >= since
    if not truth.powered[behind].any():
        return None, []
    time_s, enabled = truth.time_s[behind], truth.enabled[behind].any(axis=1)
    last = np.flatnonzero(enabled)
    periods = round((time_s[last[-1]] - time_s[0]) / 1e-3) if len(last) else 0
    bound = ALONE_CYCLES + (TURNS_CYCLES if evidence.plan.pacing == LOCKSTEP else 0)
    seen = Reaction(periods, bound)
    text = f"a drive is in operation {periods} periods after its controller has gone, {bound} allowed"
    return seen, [text] if periods > bound else []


def _powered(evidence: Evidence, cycles: int = LAST) -> bool:
    """Whether any drive had power in the cycle of the fault, or in as many behind it."""
    assert evidence.happened is not None
    truth, cycle = evidence.truth, evidence.happened[1]
    near = (truth.cycle >= cycle) & (truth.cycle <= cycle + cycles)
    return bool(truth.powered[near].any())


def _ends(evidence: Evidence, bound: int) -> list[str]:
    """Where power is off and the run is to end, it does so soon: no SYNC any more."""
    assert evidence.happened is not None
    if wanted(evidence) != "disable":
        return []
    last = max((f.cycle for f in evidence.frames if f.can_id == SYNC and f.sender is CONTROLLER), default=-1)
    late = last - evidence.happened[1]
    return [f"the run goes on for {late} cycles, {bound} allowed"] if late > bound + RAMP_CYCLES else []


def goes_on(evidence: Evidence) -> list[str]:
    """Where a fault is to have no consequence, it has none."""
    fault = evidence.plan.fault
    if evidence.happened is None or fault.event is not None or fault.kills or fault.may_stop:
        return []
    until = evidence.frames_before_stop if evidence.frames_before_stop is not None else len(evidence.frames)
    problems = []
    emcys = [f for f in evidence.frames[evidence.happened[0] : until] if f.can_id == OUR_EMCY]
    if any(frame.data[:2] != bytes(2) for frame in emcys):
        problems.append(f"our node reports an error, and nothing was wrong: {'; '.join(evidence.noted)}")
    led = dict.fromkeys(ORDERS, False)
    for place, frame, enabling in orders(evidence):
        if evidence.happened[0] <= place < until and led[frame.can_id] and not enabling:
            if evidence.plan.state not in {"stopping", "starting"}:
                problems.append(f"drive {frame.can_id - 0x200} is switched off, and nothing was wrong")
            break
        led[frame.can_id] = enabling
    return problems
