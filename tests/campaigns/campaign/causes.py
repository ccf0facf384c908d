"""When a fault of an axis can be detected: from the simulator's truth, the frames, and the set points.

A broken scale has no effect as long as its table stands, and a jam with presliding yields like a spring at
first. The page's bounds count from the cycle in which the condition that it names holds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.recording.recorder import RecordingError
from tests.campaigns.campaign import spec
from tests.campaigns.campaign.fault_context import DRIVES, SCALES
from tests.campaigns.campaign.wire import SYNC

if TYPE_CHECKING:
    from tests.campaigns.campaign.run import Evidence

DEVIATION_M = 0.5e-3
"""limits.scale_deviation_mm, where it is not given: half of following_error_mm."""
FOLLOWING_M = 1e-3 + 2e-6
"""limits.following_error_mm, and what its scale may read else."""
PERIOD_S = 1e-3
DRIFTED = "scale and encoder disagree"
"""Looked for in an axis that is led; the cycle that sees it ends that."""
TOLERATED_GAP = {"realtime": 20, "lockstep": 0}
"""Cycles without inputs."""
LIMIT_PERMILLE = 1480
"""limits.force_n as a current, 600 N at 2 pi 0.43 Nm/A / 10 mm, in shares of 1.5 A."""
TPDO, CURRENT = 0x180, slice(6, 8)
PUSHED, GATHERED_M_S, GROWN_M = 0.3, 4e-3, 4e-5
"""Beyond doubt: share of the force limit; gain of speed and of error in `runaway_ms`."""


class Cause(NamedTuple):
    """From `cycle` on, this row of the page holds."""

    cycle: int
    event: str


def scale_stands(evidence: Evidence) -> list[Cause]:
    """The table is farther from where its scale stopped than the two may differ."""
    return _apart(evidence, evidence.truth.position_m[:, evidence.axis])


def coupling_slips(evidence: Evidence) -> list[Cause]:
    """Motor and table are farther apart than the two may differ."""
    truth, axis = evidence.truth, evidence.axis
    return _apart(evidence, truth.motor_m[:, axis] - truth.position_m[:, axis])


def runs_away(evidence: Evidence) -> list[Cause]:
    """It gains speed against the force of its motor, away from its set point; or it is too far from there."""
    error_m, push, velocity_m_s = _following(evidence)
    pushed = (np.abs(push) >= PUSHED * LIMIT_PERMILLE) & (push * error_m > 0.0)
    side, block = np.sign(push), spec.UNITS["runaway_ms"]
    away = np.zeros(len(push), dtype=bool)
    for now in range(block, len(push)):
        then = now - block
        gathered_m_s = side[now] * (velocity_m_s[then] - velocity_m_s[now])
        away[now] = (
            pushed[then : now + 1].all()
            and side[now] * velocity_m_s[now] < 0.0
            and gathered_m_s > GATHERED_M_S
            and abs(error_m[now]) - abs(error_m[then]) > GROWN_M
        )
    return [*_first(np.arange(len(away)), away, "axis runs away"), *cannot_follow(evidence)]


def stays_away(evidence: Evidence) -> list[Cause]:
    """The drive leaves more SYNCs in a row without an answer than are tolerated.

    SYNCs are counted: in a gap of the controller's none is sent.
    """
    assert evidence.happened is not None
    since, its_inputs = evidence.happened[1], TPDO + DRIVES[evidence.axis]
    syncs = sorted(
        {frame.cycle for frame in evidence.frames if frame.can_id == SYNC and frame.cycle >= since}
    )
    answered = {frame.cycle for frame in evidence.frames if frame.can_id == its_inputs and frame.arrived}
    longest = in_a_row = 0
    for cycle in syncs:
        in_a_row = 0 if cycle in answered else in_a_row + 1
        longest = max(longest, in_a_row)
    return [Cause(since, "inputs missing")] if longest > TOLERATED_GAP[evidence.plan.pacing] else []


def _apart(evidence: Evidence, value_m: Array) -> list[Cause]:
    """The first cycle after the fault in which a value has changed by more than it may.

    The travel of the axis in as many cycles as its inputs may be old is allowed in addition, as on the page.
    """
    assert evidence.happened is not None
    truth, axis = evidence.truth, evidence.axis
    here = truth.cycle >= evidence.happened[1]
    if not here.any():
        return []
    travel_m = np.abs(truth.velocity_m_s[here, axis]) * PERIOD_S * _owed(evidence, truth.cycle[here])
    beyond = np.abs(value_m[here] - value_m[here][0]) > DEVIATION_M + travel_m
    return _first(truth.cycle[here], beyond, DRIFTED)


def _owed(evidence: Evidence, cycles: Array) -> Array:
    """Inputs of drive or scale that were kept from the controller before each of these cycles."""
    kept = [
        [frame.cycle for frame in evidence.frames if frame.can_id == TPDO + node and not frame.arrived]
        for node in (DRIVES[evidence.axis], SCALES[evidence.axis])
    ]
    return np.max([np.searchsorted(np.sort(each), cycles) for each in kept], axis=0)


def cannot_follow(evidence: Evidence) -> list[Cause]:
    """The table is farther from its set point than it may be, or the current too long at its limit."""
    error_m, push, _velocity_m_s = _following(evidence)
    deviation = _first(np.arange(len(error_m)), np.abs(error_m) > FOLLOWING_M, "following error")
    longest = spec.UNITS["saturation_ms"]
    if len(push) < longest:  # nothing was recorded, the disk was full
        return deviation
    controlled = np.isfinite(error_m)  # a drive that brakes by itself may take what it wants
    at_limit = (
        np.convolve(controlled & (np.abs(push) >= LIMIT_PERMILLE), np.ones(longest), "valid") >= longest
    )
    return [*deviation, *_first(np.arange(len(at_limit)), at_limit, "current saturated")]


def _following(evidence: Evidence) -> tuple[Array, Array, Array]:
    """By cycle: error (m), current that the drive reports (per mille), speed; NaN before the fault.

    Set points are those of the recording, a row a SYNC; positions are the truth.
    """
    assert evidence.happened is not None
    try:
        columns = load_recording(evidence.folder / "recording").columns
    except RecordingError:
        return np.empty(0), np.empty(0), np.empty(0)
    set_point_m = columns[f"{'xy'[evidence.axis]}.position_command_m"]
    error_m, push, velocity_m_s = (np.full(len(set_point_m), np.nan) for _ in range(3))
    truth, axis = evidence.truth, evidence.axis
    for cycle, position_m, speed_m_s in zip(
        truth.cycle.astype(int), truth.position_m[:, axis], truth.velocity_m_s[:, axis], strict=True
    ):
        if evidence.happened[1] <= cycle < len(set_point_m):
            error_m[cycle], velocity_m_s[cycle] = set_point_m[cycle] - position_m, speed_m_s
    for frame in evidence.frames[evidence.happened[0] :]:
        if (
            frame.can_id == TPDO + DRIVES[axis]
            and len(frame.data) == CURRENT.stop
            and frame.cycle < len(push)
        ):
            push[frame.cycle] = int.from_bytes(frame.data[CURRENT], "little", signed=True)
    return error_m, push, velocity_m_s


def _first(cycles: Any, beyond: Any, event: str) -> list[Cause]:
    found = np.flatnonzero(beyond)
    return [Cause(int(cycles[found[0]]), event)] if len(found) else []
