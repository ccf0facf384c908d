"""What must hold of motion: from the simulator's truth, and the frames that tell the drives what to do."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from kernels.arrays import Array
from tests.campaigns.campaign.machine import LIMIT_MM
from tests.campaigns.campaign.oracles_reaction import ORDERS, emcy_cycle, orders, wanted

if TYPE_CHECKING:
    from tests.campaigns.campaign.run import Evidence

FOLLOWING_M = 1e-3
"""limits.following_error_mm: beyond it the loop does not lead the axis any more."""
FRICTION_M_S2 = 0.1
"""What brakes an axis of the table that has no power: 8 N and 70 kg."""
BRAKING_M_S2 = 2.0
"""6085h: limits.acceleration_mm_s2."""
REST_M_S = 5e-4
TOGETHER_S = 0.015
MOVING_M_S, AT_REST = 15e-3, 0.2
"""A speed that it takes a ramp to get rid of, and the share of its own that an axis has when it is over."""
QUICK_STOPPING, STANDBY = 5, 8
BRAKING_CYCLES = 700


def within_limits(evidence: Evidence) -> list[str]:
    """No motion beyond the limits: farther only by what an axis goes that nobody can lead."""
    truth = evidence.truth
    speed_m_s = _speed_m_s(evidence)
    allowed_m = LIMIT_MM * 1e-3 + FOLLOWING_M + evidence.plan.fault.blind_s * speed_m_s
    if evidence.plan.fault.coasts or wanted(evidence) == "disable":
        allowed_m += 0.5 * np.abs(truth.velocity_m_s).max(initial=0.0) ** 2 / FRICTION_M_S2
    if evidence.plan.fault.knocks:
        allowed_m += 0.5 * speed_m_s**2 / BRAKING_M_S2
    farthest_m = float(np.abs(truth.position_m).max(initial=0.0))
    if farthest_m <= allowed_m:
        return []
    return [f"the table was at {farthest_m * 1e3:.3f} mm, {allowed_m * 1e3:.3f} mm allowed"]


def _speed_m_s(evidence: Evidence) -> float:
    """The highest speed when the fault came, or the second one."""
    if evidence.happened is None:
        return 0.0
    near = np.abs(evidence.truth.cycle - evidence.happened[1]) <= 2
    if evidence.second is not None:
        near |= np.abs(evidence.truth.cycle - evidence.second.happened[1]) <= 2
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
    """Both drives get their command in one cycle; in a controlled stop both axes come to rest together."""
    fault = evidence.plan.fault
    if fault.physical or fault.kills or evidence.happened is None or not wanted(evidence):
        return []
    truth, begun = evidence.truth, evidence.happened[0]
    led = dict.fromkeys(ORDERS, False)
    released: dict[int, int] = {}
    for place, frame, enabling in orders(evidence):
        if place >= begun and led[frame.can_id] and not enabling:
            released.setdefault(frame.can_id, frame.cycle)
        led[frame.can_id] = enabling
    problems = []
    if len(released) == 2 and len(set(released.values())) > 1:
        problems.append(f"the drives get their commands in cycles {sorted(released.values())}, not in one")
    if wanted(evidence) == "hold" and len(released) == 2:
        ramp = (
            emcy_cycle(evidence, None) or evidence.happened[1]
        )  # a request sends no EMCY: its ramp begins at once
        window = (truth.cycle >= ramp) & (truth.cycle <= min(released.values()))
        braked = any(at >= evidence.happened[1] and stage == QUICK_STOPPING for at, stage in evidence.stages)
        if braked or not truth.enabled[window].all():
            return problems  # drives that brake by themselves are led by no ramp of ours
        stopped = [_last_motion(truth.time_s[window], truth.velocity_m_s[window, axis]) for axis in (0, 1)]
        moving = [at_s for at_s in stopped if at_s is not None]
        if len(moving) == 2 and abs(moving[0] - moving[1]) > TOGETHER_S:
            problems.append(f"the axes come to rest {abs(moving[0] - moving[1]) * 1e3:.1f} ms apart")
    return problems


def _last_motion(time_s: Array, velocity_m_s: Array) -> float | None:
    """When an axis that moved comes to rest; None where it did not move."""
    if not len(time_s) or abs(velocity_m_s[0]) < MOVING_M_S:
        return None
    moves = np.abs(velocity_m_s) > AT_REST * abs(velocity_m_s[0])
    return float(time_s[np.flatnonzero(moves)[-1]])


def unasked(evidence: Evidence) -> list[str]:
    """In standby no drive is in operation; one whose frames do not arrive may still brake."""
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
