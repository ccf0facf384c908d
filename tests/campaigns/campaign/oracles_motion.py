"""Oracles of motion: from the true motion in the simulator, and the controlwords on the bus."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from kernels.arrays import Array
from tests.campaigns.campaign.machine import LIMIT_MM
from tests.campaigns.campaign.oracles_reaction import RPDO_IDS, controlwords, emcy_cycle, required_reaction

if TYPE_CHECKING:
    from tests.campaigns.campaign.run import Evidence

FOLLOWING_M = 1e-3
"""limits.following_error_mm: beyond it the loop does not control the axis."""
FRICTION_M_S2 = 0.1
"""Deceleration of an axis without power by its friction: 8 N and 70 kg."""
BRAKING_M_S2 = 2.0
"""6085h: limits.acceleration_mm_s2."""
STANDSTILL_M_S = 5e-4
"""Speed that counts as standstill in the end; chosen."""
TOGETHER_S = 0.015
"""Tolerated time between the stops of the axes; chosen."""
MOVING_M_S, STANDSTILL_SHARE = 15e-3, 0.2
"""Speed that needs a ramp to stop, and the share of its speed below which an axis has stopped; chosen."""
QUICK_STOPPING, STANDBY = 5, 8
BRAKING_CYCLES = 700


def within_limits(evidence: Evidence) -> list[str]:
    """No motion beyond the limits, but for the distance that an axis without control covers."""
    truth = evidence.truth
    speed_m_s = _speed_m_s(evidence)
    allowed_m = LIMIT_MM * 1e-3 + FOLLOWING_M + evidence.plan.fault.blind_s * speed_m_s
    if evidence.plan.fault.coasts or required_reaction(evidence) == "disable":
        allowed_m += 0.5 * np.abs(truth.velocity_m_s).max(initial=0.0) ** 2 / FRICTION_M_S2
    if evidence.plan.fault.knocks:
        allowed_m += 0.5 * speed_m_s**2 / BRAKING_M_S2
    farthest_m = float(np.abs(truth.position_m).max(initial=0.0))
    if farthest_m <= allowed_m:
        return []
    return [f"the table was at {farthest_m * 1e3:.3f} mm, {allowed_m * 1e3:.3f} mm allowed"]


def _speed_m_s(evidence: Evidence) -> float:
    """Return the highest speed at the fault or at the second one."""
    if evidence.injected is None:
        return 0.0
    around_fault = np.abs(evidence.truth.cycle - evidence.injected.cycle) <= 2
    if evidence.second is not None:
        around_fault |= np.abs(evidence.truth.cycle - evidence.second.injected.cycle) <= 2
    return float(np.abs(evidence.truth.velocity_m_s[around_fault]).max(initial=0.0))


def at_rest(evidence: Evidence) -> list[str]:
    """At the end the table stands still, and no drive has power."""
    if evidence.plan.fault.kills == "nodes" and evidence.injected is not None:
        return []  # the simulated table has ended
    truth = evidence.truth
    if not len(truth.time_s):
        return []
    last = truth.time_s > truth.time_s[-1] - 0.05
    problems = []
    if truth.powered[-1].any():
        problems.append("a drive has power in the end")
    speed_m_s = float(np.abs(truth.velocity_m_s[last]).max())
    if speed_m_s > STANDSTILL_M_S:
        problems.append(f"the table moves in the end, at {speed_m_s * 1e3:.3f} mm/s")
    return problems


def axes_stop_together(evidence: Evidence) -> list[str]:
    """Both drives get their command in one cycle; in a controlled stop both axes stop together."""
    fault = evidence.plan.fault
    if fault.physical or fault.kills or evidence.injected is None or not required_reaction(evidence):
        return []
    truth, begin = evidence.truth, evidence.injected.frame_index
    was_enabled = dict.fromkeys(RPDO_IDS, False)
    released: dict[int, int] = {}
    for place, frame, enabling in controlwords(evidence):
        if place >= begin and was_enabled[frame.can_id] and not enabling:
            released.setdefault(frame.can_id, frame.cycle)
        was_enabled[frame.can_id] = enabling
    problems = []
    if len(released) == 2 and len(set(released.values())) > 1:
        problems.append(f"the drives get their commands in cycles {sorted(released.values())}, not in one")
    if required_reaction(evidence) == "hold" and len(released) == 2:
        # a request sends no EMCY, and its ramp begins at once
        ramp = emcy_cycle(evidence, None) or evidence.injected.cycle
        window = (truth.cycle >= ramp) & (truth.cycle <= min(released.values()))
        drive_braked = any(
            at >= evidence.injected.cycle and stage == QUICK_STOPPING for at, stage in evidence.stages
        )
        if drive_braked or not truth.enabled[window].all():
            return problems  # drives that brake by themselves follow no ramp of the controller
        stopped = [_last_motion(truth.time_s[window], truth.velocity_m_s[window, axis]) for axis in (0, 1)]
        moving = [at_s for at_s in stopped if at_s is not None]
        if len(moving) == 2 and abs(moving[0] - moving[1]) > TOGETHER_S:
            problems.append(f"the axes come to rest {abs(moving[0] - moving[1]) * 1e3:.1f} ms apart")
    return problems


def _last_motion(time_s: Array, velocity_m_s: Array) -> float | None:
    """Return when an axis stops; None if it did not move."""
    if not len(time_s) or abs(velocity_m_s[0]) < MOVING_M_S:
        return None
    moves = np.abs(velocity_m_s) > STANDSTILL_SHARE * abs(velocity_m_s[0])
    return float(time_s[np.flatnonzero(moves)[-1]])


def no_operation_in_standby(evidence: Evidence) -> list[str]:
    """In standby no drive is in operation; one whose frames do not arrive may still brake."""
    truth = evidence.truth
    changes = [*evidence.stages, (10**9, 0)]
    undetected = round(evidence.plan.fault.blind_s * 1e3) + 2
    for (begin, stage), (ended, _next) in pairwise(changes):
        if stage == STANDBY:
            inside = (truth.cycle > begin + undetected) & (truth.cycle < ended)
            if truth.enabled[inside].any():
                return ["a drive is in operation in standby"]
            if truth.powered[inside & (truth.cycle > begin + BRAKING_CYCLES)].any():
                return ["a drive has power in standby"]
    return []
