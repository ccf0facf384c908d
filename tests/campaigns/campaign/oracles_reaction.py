"""Oracles of reactions: the frames on the bus against docs/fault_policy.md."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tests.campaigns.campaign import spec
from tests.campaigns.campaign.fault_context import DRIVES, LOCKSTEP, SILENCING_EVENTS
from tests.campaigns.campaign.wire import CONTROLLER, NMT, SYNC

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.campaigns.campaign.run import Evidence
    from tests.campaigns.campaign.wire import Frame

OUR_EMCY = 0x0FF
NMT_LEAVE_OPERATIONAL = (b"\x02", b"\x80")
"""NMT commands stop and enter pre-operational: a drive that leaves operational brakes by itself (6007h)."""
ENABLED = 0x0F
UNATTENDED_CYCLES = 3 * spec.HEARTBEAT_CYCLES + 12
"""Bounds the operation without a controller: three heartbeats (1016h), and the poll interval of the simulator
without SYNC."""
LOCKSTEP_LAG_CYCLES = 80
"""Bounds the turns of the loop in lockstep between an exception and the end of its cycle; chosen."""
RAMP_CYCLES = 60
"""A controlled stop from the highest speed of the campaign at the acceleration limit, and power off."""
REQUESTS = {"stop signal", "switched off"}
"""Requests send no EMCY: the bus shows only that power goes off."""
STARTING = 1
NEVER = 10**9
RPDO_IDS = (0x200 + DRIVES[0], 0x200 + DRIVES[1])


class Reaction(NamedTuple):
    """A reaction on the bus: cycles from the fault to it, and their bound."""

    cycles: int
    bound: int


def controlwords(evidence: Evidence) -> Iterator[tuple[int, Frame, bool]]:
    """Yield index, frame, and whether it keeps its drive in operation, of the RPDOs of the controller."""
    for place, frame in enumerate(evidence.frames):
        if frame.can_id in RPDO_IDS and frame.sender is CONTROLLER and len(frame.data) >= 2:
            yield place, frame, frame.data[0] & ENABLED == ENABLED


def first_reaction(evidence: Evidence) -> int | None:
    """Return the cycle of the first frame of a reaction: our EMCY, or the end of operation of a drive."""
    if evidence.injected is None:
        return None
    begin, until = evidence.injected.frame_index, _next_switch_on(evidence)
    was_enabled = dict.fromkeys(RPDO_IDS, False)
    released: int | None = None
    for place, frame, enabling in controlwords(evidence):
        if place >= begin and was_enabled[frame.can_id] and not enabling:
            released = frame.cycle
            break
        was_enabled[frame.can_id] = enabling
    reported = emcy_cycle(evidence, len(evidence.frames))
    nmt_commands = (f for f in evidence.frames[begin:] if f.can_id == NMT and f.sender is CONTROLLER)
    leave_cycle = next(
        (frame.cycle for frame in nmt_commands if frame.data[:1] in NMT_LEAVE_OPERATIONAL), None
    )
    return min(
        (cycle for cycle in (released, reported, leave_cycle) if cycle is not None and cycle <= until),
        default=None,
    )


def _next_switch_on(evidence: Evidence) -> int:
    """Return the cycle of the next switch-on, after which no frame belongs to the reaction."""
    assert evidence.injected is not None
    after_fault = (
        at for at, stage in evidence.stages if stage == STARTING and at > evidence.injected.cycle + 1
    )
    return next(after_fault, NEVER)


def required_reaction(evidence: Evidence) -> str:
    """Return the reaction that the page requires; "" if the machine continues."""
    fault = evidence.plan.fault
    if evidence.injected is None or fault.event is None:
        return ""
    stage = evidence.injected.stage.name.lower().replace("_", " ")
    return spec.reactions()[fault.event][stage]


def reaction(evidence: Evidence) -> tuple[Reaction | None, list[str]]:
    """Return the reaction, None if none is required or visible, and the violations."""
    if evidence.plan.fault.kills in {"controller", "task"}:
        return unattended_drives(evidence)
    if evidence.plan.fault.event == "bus off" and required_reaction(evidence):
        return unattended_drives(evidence)  # no frame is sent
    seen, problems = reaction_on_bus(evidence)
    if evidence.plan.fault.event in SILENCING_EVENTS and required_reaction(evidence):
        # the frames do not arrive, so the drives stop by themselves
        unattended, more = unattended_drives(evidence)
        return seen or unattended, problems + more
    return seen, problems


def reaction_on_bus(evidence: Evidence) -> tuple[Reaction | None, list[str]]:
    """Return the reaction on the bus, and the violations."""
    reaction_name = required_reaction(evidence)
    if not reaction_name or evidence.injected is None or evidence.plan.fault.event is None:
        return None, []
    fault = evidence.plan.fault
    due = _detectable_from(evidence)
    if due is None:
        return _early_reaction(evidence), []
    since, bound = due
    if reaction_name == "hold" and fault.event in REQUESTS:
        bound += RAMP_CYCLES
    if fault.event in REQUESTS and not _any_power(evidence):
        return None, _late_end(evidence, bound)  # the drives were and stay off
    cycle = first_reaction(evidence)
    if cycle is None:
        if not _any_power(evidence, 1) or reaction_name == "disable":
            return None, _late_end(evidence, bound)
        return None, [f"{reaction_name} required, but the bus shows no reaction"]
    seen = Reaction(cycle - since, bound)
    late = [f"{reaction_name} after {seen.cycles} cycles, {bound} allowed"]
    return seen, late if seen.cycles > bound else []


def _detectable_from(evidence: Evidence) -> tuple[int, int] | None:
    """Return the cycle from which the fault is detectable, and the allowed cycles; None: it never was."""
    assert evidence.injected is not None
    fault = evidence.plan.fault
    assert fault.event is not None
    bounds = spec.bounds(lockstep=evidence.plan.pacing == LOCKSTEP)
    if fault.cause is None:
        return evidence.injected.cycle, max(bounds[event].cycles for event in (fault.event, *fault.also))
    times = [(cause.cycle, bounds[cause.event].cycles) for cause in fault.cause(evidence)]
    return min(times, key=sum, default=None)


def _early_reaction(evidence: Evidence) -> Reaction | None:
    """Return a reaction in time if the machine reported the fault before the bound required it."""
    fault = evidence.plan.fault
    assert fault.event is not None
    if emcy_cycle(evidence, evidence.frames_before_stop) is None:
        return None
    return Reaction(0, spec.bounds(lockstep=evidence.plan.pacing == LOCKSTEP)[fault.event].cycles)


def emcy_cycle(evidence: Evidence, until: int | None) -> int | None:
    """Return the cycle of our first EMCY after the fault, among the frames up to `until`."""
    assert evidence.injected is not None
    after_fault = evidence.frames[evidence.injected.frame_index : until]
    return next((f.cycle for f in after_fault if f.can_id == OUR_EMCY and f.data[:2] != bytes(2)), None)


def unattended_drives(evidence: Evidence) -> tuple[Reaction | None, list[str]]:
    """No drive stays in operation without a controller, once it has missed our heartbeats."""
    controller_killed = evidence.plan.fault.kills == "controller"
    if evidence.injected is None or (controller_killed and evidence.killed_cycle is None):
        return None, []
    since = evidence.killed_cycle if controller_killed else evidence.injected.cycle
    truth = evidence.truth
    after_fault = truth.cycle >= since
    if not truth.powered[after_fault].any():
        return None, []
    time_s, enabled = truth.time_s[after_fault], truth.enabled[after_fault].any(axis=1)
    last = np.flatnonzero(enabled)
    periods = round((time_s[last[-1]] - time_s[0]) / 1e-3) if len(last) else 0
    bound = UNATTENDED_CYCLES + (LOCKSTEP_LAG_CYCLES if evidence.plan.pacing == LOCKSTEP else 0)
    seen = Reaction(periods, bound)
    text = f"a drive is in operation {periods} periods after its controller has gone, {bound} allowed"
    return seen, [text] if periods > bound else []


def _any_power(evidence: Evidence, cycles: int = NEVER) -> bool:
    """Return whether any drive had power in the cycle of the fault or in the `cycles` after it."""
    assert evidence.injected is not None
    truth, cycle = evidence.truth, evidence.injected.cycle
    near = (truth.cycle >= cycle) & (truth.cycle <= cycle + cycles)
    return bool(truth.powered[near].any())


def _late_end(evidence: Evidence, bound: int) -> list[str]:
    """Check that a run which must end soon sends no further SYNC."""
    assert evidence.injected is not None
    if required_reaction(evidence) != "disable":
        return []
    last = max((f.cycle for f in evidence.frames if f.can_id == SYNC and f.sender is CONTROLLER), default=-1)
    late = last - evidence.injected.cycle
    return [f"the run goes on for {late} cycles, {bound} allowed"] if late > bound + RAMP_CYCLES else []


def no_reaction(evidence: Evidence) -> list[str]:
    """A fault that must have no consequence has none."""
    fault = evidence.plan.fault
    if evidence.injected is None or fault.event is not None or fault.kills or fault.may_stop:
        return []
    until = evidence.frames_before_stop if evidence.frames_before_stop is not None else len(evidence.frames)
    problems = []
    emcys = [f for f in evidence.frames[evidence.injected.frame_index : until] if f.can_id == OUR_EMCY]
    if any(frame.data[:2] != bytes(2) for frame in emcys):
        problems.append(f"our node reports an error, without a cause: {'; '.join(evidence.reported)}")
    was_enabled = dict.fromkeys(RPDO_IDS, False)
    for place, frame, enabling in controlwords(evidence):
        if evidence.injected.frame_index <= place < until and was_enabled[frame.can_id] and not enabling:
            if evidence.plan.state not in {"stopping", "starting"}:
                problems.append(f"drive {frame.can_id - 0x200} is switched off, without a cause")
            break
        was_enabled[frame.can_id] = enabling
    return problems
