"""What the MQTT topics carry: JSON, every quantity with its unit in the key. docs/mqtt.md is the reference.

Errors are in micrometres, accelerations in mm/s^2, as the machine file and the papers have them. A quantity
that is not known (yet) is null.
"""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from servo_ctrl.config.desk import LEARNERS, LearningState, Setting

if TYPE_CHECKING:
    from servo_ctrl.config.desk import AxisStatus, DeskStatus, LearningStatus, ScrewStatus
    from servo_ctrl.learning.types import Learned, ReversalReport

STAGES = (
    "booting",
    "starting",
    "ready",
    "running",
    "stopping",
    "quick_stopping",
    "disabling",
    "off",
    "standby",
)
"""Names of `axis.fault_policy.Stage`, by value."""
ONLINE, OFFLINE = b"online", b"offline"


def state_payload(status: DeskStatus, reversals_dropped: int) -> bytes:
    """The state of the whole machine, without the learned functions."""
    return _encoded(
        {
            **_moment(status.cycles),
            "missed_ticks": status.missed_ticks,
            "stage": STAGES[status.stage],
            "reason": status.reason,
            "learning": _learning(status.learning),
            "axis": {axis.name: _axis(axis) for axis in status.axes},
            "settings": {
                "required_um": _scaled(status.settings[Setting.REQUIRED_M], 1e6),
                "learner": LEARNERS[int(status.settings[Setting.LEARNER])],
                "adaptation": bool(status.settings[Setting.ADAPTATION]),
            },
            "reversals_dropped": reversals_dropped,
        }
    )


def reversal_payload(report: ReversalReport, noted: datetime) -> bytes:
    """The indicators of one reversal; the cycle is that of the reversal itself."""
    return _encoded(
        {
            **_moment(report.cycle, noted),
            "direction": report.direction,
            "acceleration_mm_s2": _scaled(report.acceleration_m_s2, 1e3),
            "contour_peak_um": _scaled(report.contour_peak_m, 1e6),
            "error_peak_um": _scaled(report.error_peak_m, 1e6),
            "error_rms_um": _scaled(report.error_rms_m, 1e6),
            "error_mean_um": _scaled(report.error_mean_m, 1e6),
        }
    )


def due_payload(cycle: int, *, due: bool) -> bytes:
    """Whether learning is due for an axis, as it stood in that cycle."""
    return _encoded({**_moment(cycle), "due": due})


def learned_payload(cycle: int, axis: AxisStatus) -> bytes:
    """The learned functions in use by an axis; `functions` is null without."""
    return _encoded(
        {
            **_moment(cycle),
            "version": axis.version,
            "learned_at": axis.learned_at or None,
            "functions": None if axis.learned is None else _functions(axis.learned),
        }
    )


def ack_payload(cycle: int, request_id: str | None, refusal: str, reason: str) -> bytes:
    """The answer to a command; `refusal` is "none" when it was accepted."""
    return _encoded(
        {
            **_moment(cycle),
            "id": request_id,
            "accepted": refusal == "none",
            "refusal": refusal,
            "reason": reason,
        }
    )


def _learning(learning: LearningStatus) -> dict[str, Any]:
    outlook = learning.outlook
    told: dict[str, Any] = {
        "state": LearningState(learning.state).name.lower(),
        "axis": learning.axis or None,
        "reason": learning.reason,
    }
    if outlook is None:
        return told
    return told | {
        "stage": outlook.stage,
        "strokes_done": outlook.strokes_done,
        "strokes_total": outlook.strokes_total,
        "progress": round(min(1.0, outlook.strokes_done / max(1, outlook.strokes_total)), 4),
        "remaining_s": _scaled(outlook.remaining_s, 1.0),
        "acceleration_mm_s2": _scaled(outlook.acceleration_m_s2, 1e3),
        "best_um": _scaled(outlook.best_m, 1e6),
    }


def _axis(axis: AxisStatus) -> dict[str, Any]:
    return {
        "compensation": axis.compensation_enabled,
        "observer": axis.observer_enabled,
        "learning_due": axis.learning_due,
        "reversals": axis.reversals,
        "error_mean_um": None if axis.last is None else _scaled(axis.last.error_mean_m, 1e6),
        "version": axis.version,
        "learned_at": axis.learned_at or None,
        "screw": _screw(axis.screw),
    }


def _screw(screw: ScrewStatus) -> dict[str, Any]:
    told: dict[str, Any] = {
        "enabled": screw.enabled,
        "version": screw.version,
        "learned_at": screw.learned_at or None,
    }
    if screw.learned is None:
        return told
    return told | {
        "lost_motion_um": _scaled(screw.learned.lost_motion_m, 1e6),
        "before_um": _scaled(screw.learned.before_m, 1e6),
        "after_um": _scaled(screw.learned.after_m, 1e6),
    }


def _functions(learned: Learned) -> dict[str, Any]:
    return {
        "learner": learned.learner,
        "strokes": learned.strokes,
        "machine_time_s": _scaled(learned.machine_time_s, 1.0),
        "before_um": _scaled(learned.before_m, 1e6),
        "after_um": _scaled(learned.after_m, 1e6),
        "spread_mm_s2": _scaled(learned.spread_m_s2, 1e3),
        "durations": _points(learned.durations, ("duration_ms",)),
        "amplitudes": _points(learned.amplitudes, ("amplitude_mm_s",)),
        "trailing": _points(learned.trailing, ("start_ms", "duration_ms", "amplitude_mm_s")),
    }


def _points(points: tuple[tuple[float, ...], ...], names: tuple[str, ...]) -> list[dict[str, float | None]]:
    """Points of a function of the reverse acceleration; every quantity in a thousandth of its SI unit."""
    keys = ("acceleration_mm_s2", *names)
    return [{key: _scaled(value, 1e3) for key, value in zip(keys, point, strict=True)} for point in points]


def _moment(cycle: int, time: datetime | None = None) -> dict[str, Any]:
    return {"time": (time or datetime.now(UTC)).isoformat(timespec="milliseconds"), "cycle": cycle}


def _scaled(value: float, factor: float) -> float | None:
    """In the unit of the topic, to six decimals; null for what is no number."""
    return round(value * factor, 6) if math.isfinite(value) else None


def _encoded(content: dict[str, Any]) -> bytes:
    return json.dumps(content, allow_nan=False, separators=(",", ":")).encode("ascii")
