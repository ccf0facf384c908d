"""What must hold of motion and reaction: from the simulator's truth and the frames on the bus alone."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tests.campaign import spec
from tests.campaign.machine import LIMIT_MM
from tests.campaign.scene import DRIVES, LOCKSTEP
from tests.campaign.wire import CONTROLLER, SYNC

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.campaign.run import Evidence
    from tests.campaign.truth import Array
    from tests.campaign.wire import Frame

OUR_EMCY = 0x0FF
ENABLED = 0x0F
FOLLOWING_M = 1e-3
"""limits.following_error_mm: beyond it the loop does not lead the axis any more."""
FRICTION_M_S2 = 0.1
"""What brakes an axis of the table that has no power: 8 N and 70 kg."""
REST_M_S = 5e-4
RAMP_CYCLES = 60
"""A controlled stop from the highest speed of the campaign at the acceleration limit, and power off."""
TOGETHER_S = 0.015
MOVING_M_S = 5e-3
RUNNING, STANDBY = 3, 8
SHOWS_M_S = 0.01
BRAKING_CYCLES = 700
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
    """Cycle of the first frame that tells of one: our EMCY, or a drive that is not kept in operation."""
    if evidence.happened is None:
        return None
    begun = evidence.happened[0]
    led = dict.fromkeys(ORDERS, False)
    for place, frame, enabling in orders(evidence):
        if place >= begun and led[frame.can_id] and not enabling:
            released: int | None = frame.cycle
            break
        led[frame.can_id] = enabling
    else:
        released = None
    told = next(
        (f.cycle for f in evidence.frames[begun:] if f.can_id == OUR_EMCY and f.data[:2] != bytes(2)), None
    )
    seen = [cycle for cycle in (released, told) if cycle is not None]
    return min(seen, default=None)


def wanted(evidence: Evidence) -> str:
    """What the documents want: a reaction, or "" where the machine goes on."""
    fault = evidence.plan.fault
    if evidence.happened is None or fault.event is None:
        return ""
    stage = evidence.happened[3].name.lower().replace("_", " ")
    return spec.reactions()[fault.event][stage]


def reaction(evidence: Evidence) -> tuple[Reaction | None, list[str]]:
    """The reaction and its bound; None where there is to be none, or nothing to see of it."""
    word = wanted(evidence)
    if not word or evidence.happened is None or evidence.plan.fault.event is None:
        return None, []
    bounds = spec.bounds(lockstep=evidence.plan.pacing == LOCKSTEP)
    fault = evidence.plan.fault
    bound = fault.slack_cycles + max(bounds[event].cycles for event in (fault.event, *fault.also))
    since = evidence.happened[1] if fault.cause is None else fault.cause(evidence)
    if since is None or not shows(evidence):
        return None, []
    if word == "hold" and fault.event in {"stop signal", "switched off"}:
        bound += RAMP_CYCLES  # a wish is not told by EMCY: what shows is the power that goes, in the end
    cycle = first_reaction(evidence)
    if cycle is None:
        if not _powered_at(evidence) or word == "disable":
            return None, _ends(evidence, bound)
        return None, [f"{word} wanted, and nothing of it seen on the bus"]
    seen = Reaction(cycle - since, bound)
    return seen, [f"{word} after {seen.cycles} cycles, {bound} allowed"] if seen.cycles > bound else []


def shows(evidence: Evidence) -> bool:
    """Whether what has befallen an axis can show: it moves for long enough."""
    fault, truth = evidence.plan.fault, evidence.truth
    if evidence.happened is None or not fault.needs_motion:
        return True
    cycle = evidence.happened[1]
    before = (truth.cycle >= cycle - 2) & (truth.cycle <= cycle)
    fast = np.abs(truth.velocity_m_s[before, evidence.axis]).max(initial=0.0) > SHOWS_M_S
    left = [begun for begun, stage in evidence.stages if begun > cycle and stage != RUNNING]
    return bool(fast) and (not left or left[0] - cycle > fault.slack_cycles)


def _powered_at(evidence: Evidence) -> bool:
    """Whether any drive had power when the fault came, or some cycles on."""
    assert evidence.happened is not None
    truth, cycle = evidence.truth, evidence.happened[1]
    near = (truth.cycle >= cycle) & (truth.cycle <= cycle + 1)
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
    """Where nothing is to come of a fault, nothing does."""
    fault = evidence.plan.fault
    if evidence.happened is None or fault.event is not None or fault.kills or fault.may_stop:
        return []
    until = evidence.asked if evidence.asked is not None else len(evidence.frames)
    problems = []
    told = [f for f in evidence.frames[evidence.happened[0] : until] if f.can_id == OUR_EMCY]
    if any(frame.data[:2] != bytes(2) for frame in told):
        problems.append(f"our node reports an error, and nothing was wrong: {'; '.join(evidence.noted)}")
    led = dict.fromkeys(ORDERS, False)
    for place, frame, enabling in orders(evidence):
        if evidence.happened[0] <= place < until and led[frame.can_id] and not enabling:
            if evidence.plan.state not in {"stopping", "starting"}:
                problems.append(f"drive {frame.can_id - 0x200} is switched off, and nothing was wrong")
            break
        led[frame.can_id] = enabling
    return problems


def within_limits(evidence: Evidence) -> list[str]:
    """No motion beyond the limits: farther only by what an axis goes that nobody can lead."""
    truth = evidence.truth
    speed_m_s = _speed_m_s(evidence)
    allowed_m = LIMIT_MM * 1e-3 + FOLLOWING_M + evidence.plan.fault.blind_s * speed_m_s
    if evidence.plan.fault.coasts or wanted(evidence) == "disable":
        allowed_m += 0.5 * np.abs(truth.velocity_m_s).max(initial=0.0) ** 2 / FRICTION_M_S2
    farthest_m = float(np.abs(truth.position_m).max(initial=0.0))
    if farthest_m <= allowed_m:
        return []
    return [f"the table was at {farthest_m * 1e3:.3f} mm, {allowed_m * 1e3:.3f} mm allowed"]


def _speed_m_s(evidence: Evidence) -> float:
    """The highest speed when the fault came."""
    if evidence.happened is None:
        return 0.0
    near = np.abs(evidence.truth.cycle - evidence.happened[1]) <= 2
    return float(np.abs(evidence.truth.velocity_m_s[near]).max(initial=0.0))


def at_rest(evidence: Evidence) -> list[str]:
    """In the end the table stands still, and no drive has power."""
    if evidence.plan.fault.kills == "nodes" and evidence.happened is not None:
        return []  # there is no table any more
    truth = evidence.truth
    if not len(truth.time_s):
        return []
    last = truth.time_s > truth.time_s[-1] - 0.05
    problems = []
    if truth.powered[-1].any():
        problems.append("a drive has power in the end")
    speed_m_s = float(np.abs(truth.velocity_m_s[last]).max())
    if speed_m_s > REST_M_S:
        problems.append(f"the table moves in the end, at {speed_m_s * 1e3:.3f} mm/s")
    return problems


def together(evidence: Evidence) -> list[str]:
    """Both drives are told in the same cycle, and in a controlled stop both axes come to rest together."""
    fault = evidence.plan.fault
    if fault.physical or fault.kills or evidence.happened is None or not wanted(evidence):
        return []
    truth, begun = evidence.truth, evidence.happened[0]
    led = dict.fromkeys(ORDERS, False)
    told: dict[int, int] = {}
    for place, frame, enabling in orders(evidence):
        if place >= begun and led[frame.can_id] and not enabling:
            told.setdefault(frame.can_id, frame.cycle)
        led[frame.can_id] = enabling
    problems = []
    if len(told) == 2 and len(set(told.values())) > 1:
        problems.append(f"the drives are told in cycles {sorted(told.values())}, not in one")
    if wanted(evidence) == "hold" and len(told) == 2:
        window = (truth.cycle >= evidence.happened[1]) & (truth.cycle <= min(told.values()))
        stopped = [_last_motion(truth.time_s[window], truth.velocity_m_s[window, axis]) for axis in (0, 1)]
        moving = [at_s for at_s in stopped if at_s is not None]
        if len(moving) == 2 and abs(moving[0] - moving[1]) > TOGETHER_S:
            problems.append(f"the axes come to rest {abs(moving[0] - moving[1]) * 1e3:.1f} ms apart")
    return problems


def _last_motion(time_s: Array, velocity_m_s: Array) -> float | None:
    """When an axis that moved comes to rest; None where it did not move."""
    if not len(time_s) or abs(velocity_m_s[0]) < MOVING_M_S:
        return None
    return float(time_s[np.flatnonzero(np.abs(velocity_m_s) > MOVING_M_S)[-1]])


def unasked(evidence: Evidence) -> list[str]:
    """In standby no drive is in operation; one that nobody hears may still brake."""
    truth = evidence.truth
    changes = [*evidence.stages, (10**9, 0)]
    blind = round(evidence.plan.fault.blind_s * 1e3) + 2
    for (begun, stage), (ended, _next) in pairwise(changes):
        if stage == STANDBY:
            inside = (truth.cycle > begun + blind) & (truth.cycle < ended)
            if truth.enabled[inside].any():
                return ["a drive is in operation in standby"]
            if truth.powered[inside & (truth.cycle > begun + BRAKING_CYCLES)].any():
                return ["a drive has power in standby"]
    return []
