"""When a fault of an axis can be detected: from the true motion, the frames, and the set points.

A broken scale has no effect while its table stands still, and a jam with presliding first yields like a
spring. The bounds of docs/fault_policy.md count from the cycle in which the condition of the row holds.
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
"""Default of limits.scale_deviation_mm: half of following_error_mm."""
FOLLOWING_M = 1e-3 + 2e-6
"""limits.following_error_mm, and the reading error of the scale."""
PERIOD_S = 1e-3
SENSORS_DISAGREE = "scale and encoder disagree"
"""Detected only in an axis under control, until the cycle that detects it."""
TOLERATED_GAP = {"realtime": 20, "lockstep": 0}
"""Tolerated cycles without inputs, by pacing."""
LIMIT_PERMILLE = 1480
"""limits.force_n as a current: 600 N at 2 pi 0.43 Nm/A / 10 mm, in thousandths of 1.5 A."""
TPDO, CURRENT = 0x180, slice(6, 8)
PUSH_SHARE, SPEED_GAIN_M_S, ERROR_GROWTH_M = 0.3, 4e-3, 4e-5
"""A certain runaway: share of the force limit; growth of speed and of error in `runaway_ms`; chosen."""


class Cause(NamedTuple):
    """The row `event` of the page holds from `cycle` on."""

    cycle: int
    event: str


def scale_frozen(evidence: Evidence) -> list[Cause]:
    """Return when the table is farther from the reading of its frozen scale than allowed."""
    return _deviation_exceeded(evidence, evidence.truth.position_m[:, evidence.axis])


def coupling_slipped(evidence: Evidence) -> list[Cause]:
    """Return when motor and table are farther apart than allowed."""
    truth, axis = evidence.truth, evidence.axis
    return _deviation_exceeded(evidence, truth.motor_m[:, axis] - truth.position_m[:, axis])


def runs_away(evidence: Evidence) -> list[Cause]:
    """Return when the axis gains speed against its motor force, away from its set point, or cannot follow."""
    error_m, current_permille, velocity_m_s = _tracking_by_cycle(evidence)
    pushing = (np.abs(current_permille) >= PUSH_SHARE * LIMIT_PERMILLE) & (current_permille * error_m > 0.0)
    direction, block = np.sign(current_permille), spec.UNITS["runaway_ms"]
    runaway = np.zeros(len(current_permille), dtype=bool)
    for now in range(block, len(current_permille)):
        block_start = now - block
        gained_m_s = direction[now] * (velocity_m_s[block_start] - velocity_m_s[now])
        runaway[now] = (
            pushing[block_start : now + 1].all()
            and direction[now] * velocity_m_s[now] < 0.0
            and gained_m_s > SPEED_GAIN_M_S
            and abs(error_m[now]) - abs(error_m[block_start]) > ERROR_GROWTH_M
        )
    return [*_first_cause(np.arange(len(runaway)), runaway, "axis runs away"), *cannot_follow(evidence)]


def inputs_stay_missing(evidence: Evidence) -> list[Cause]:
    """Return whether the inputs of the drive are missing after more consecutive SYNCs than tolerated.

    It counts SYNCs, because the controller sends none in a gap of its ticks.
    """
    assert evidence.injected is not None
    since, tpdo_id = evidence.injected.cycle, TPDO + DRIVES[evidence.axis]
    syncs = sorted(
        {frame.cycle for frame in evidence.frames if frame.can_id == SYNC and frame.cycle >= since}
    )
    cycles_with_inputs = {
        frame.cycle for frame in evidence.frames if frame.can_id == tpdo_id and frame.arrived
    }
    longest = missing = 0
    for cycle in syncs:
        missing = 0 if cycle in cycles_with_inputs else missing + 1
        longest = max(longest, missing)
    return [Cause(since, "inputs missing")] if longest > TOLERATED_GAP[evidence.plan.pacing] else []


def _deviation_exceeded(evidence: Evidence, value_m: Array) -> list[Cause]:
    """Return the first cycle after the fault in which a value has changed by more than allowed.

    The allowance includes the travel of the axis during the age of its inputs, as on the page.
    """
    assert evidence.injected is not None
    truth, axis = evidence.truth, evidence.axis
    after_fault = truth.cycle >= evidence.injected.cycle
    if not after_fault.any():
        return []
    travel_m = (
        np.abs(truth.velocity_m_s[after_fault, axis])
        * PERIOD_S
        * _missing_inputs(evidence, truth.cycle[after_fault])
    )
    beyond = np.abs(value_m[after_fault] - value_m[after_fault][0]) > DEVIATION_M + travel_m
    return _first_cause(truth.cycle[after_fault], beyond, SENSORS_DISAGREE)


def _missing_inputs(evidence: Evidence, cycles: Array) -> Array:
    """Return how many inputs of drive or scale did not arrive before each of these cycles."""
    not_arrived = [
        [frame.cycle for frame in evidence.frames if frame.can_id == TPDO + node and not frame.arrived]
        for node in (DRIVES[evidence.axis], SCALES[evidence.axis])
    ]
    return np.max([np.searchsorted(np.sort(each), cycles) for each in not_arrived], axis=0)


def cannot_follow(evidence: Evidence) -> list[Cause]:
    """Return when the table is too far from its set point, or the current too long at its limit."""
    error_m, current_permille, _velocity_m_s = _tracking_by_cycle(evidence)
    deviation = _first_cause(np.arange(len(error_m)), np.abs(error_m) > FOLLOWING_M, "following error")
    longest = spec.UNITS["saturation_ms"]
    if len(current_permille) < longest:  # nothing was recorded because the disk was full
        return deviation
    controlled = np.isfinite(error_m)  # the current of a drive that brakes by itself is not limited here
    at_limit = (
        np.convolve(controlled & (np.abs(current_permille) >= LIMIT_PERMILLE), np.ones(longest), "valid")
        >= longest
    )
    return [*deviation, *_first_cause(np.arange(len(at_limit)), at_limit, "current saturated")]


def _tracking_by_cycle(evidence: Evidence) -> tuple[Array, Array, Array]:
    """Return error (m), reported current (per mille) and speed (m/s) by cycle; NaN before the fault.

    Set points are those of the recording, one row per SYNC; positions are the true ones.
    """
    assert evidence.injected is not None
    try:
        columns = load_recording(evidence.folder / "recording").columns
    except RecordingError:
        return np.empty(0), np.empty(0), np.empty(0)
    set_point_m = columns[f"{'xy'[evidence.axis]}.position_command_m"]
    error_m, current_permille, velocity_m_s = (np.full(len(set_point_m), np.nan) for _ in range(3))
    truth, axis = evidence.truth, evidence.axis
    for cycle, position_m, speed_m_s in zip(
        truth.cycle.astype(int), truth.position_m[:, axis], truth.velocity_m_s[:, axis], strict=True
    ):
        if evidence.injected.cycle <= cycle < len(set_point_m):
            error_m[cycle], velocity_m_s[cycle] = set_point_m[cycle] - position_m, speed_m_s
    for frame in evidence.frames[evidence.injected.frame_index :]:
        if (
            frame.can_id == TPDO + DRIVES[axis]
            and len(frame.data) == CURRENT.stop
            and frame.cycle < len(current_permille)
        ):
            current_permille[frame.cycle] = int.from_bytes(frame.data[CURRENT], "little", signed=True)
    return error_m, current_permille, velocity_m_s


def _first_cause(cycles: Any, beyond: Any, event: str) -> list[Cause]:
    indices = np.flatnonzero(beyond)
    return [Cause(int(cycles[indices[0]]), event)] if len(indices) else []
