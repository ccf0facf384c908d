"""What the server tells of the machine, as JSON: `config.local_status` from what desk and bus know.

Made in the thread of the cycle ten times a second, so it is made of plain dictionaries; the receiver checks
them. What changes rarely and is long (learned functions) is encoded once.
"""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, NamedTuple

from servo_ctrl.config.desk import LEARNERS, LearningState, Setting
from servo_ctrl.telemetry.mqtt_payloads import STAGES

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable

    from numpy.typing import NDArray

    from servo_ctrl.config.desk import AxisStatus, DeskStatus, DriveStatus, LearningStatus, ScrewStatus
    from servo_ctrl.learning.types import Learned, ReversalReport


class BusFigures(NamedTuple):
    """What a status says of the bus, JSON already; see `daemon.bus_watch`."""

    bus: bytes
    nodes: bytes
    emcy: bytes
    events: bytes


class StatusEncoder:
    """Remembers what it has encoded of the learned results."""

    def __init__(self) -> None:
        self._learned: dict[int, tuple[Any, bytes]] = {}
        self._screws: dict[int, tuple[Any, bytes]] = {}

    def pieces(self, status: DeskStatus, figures: BusFigures) -> Generator[None, None, bytes]:
        """A status without `rows_missed`, which is each client's own, and without the closing brace."""
        told = {
            "kind": "status",
            "time": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "stage": STAGES[status.stage],
            "reason": status.reason,
            "cycles": status.cycles,
            "missed_ticks": status.missed_ticks,
            "learning": _learning(status.learning),
            "drives": [_drive(drive) for drive in status.drives],
            "program": status.program._asdict(),
            "settings": {
                "required_m": status.settings[Setting.REQUIRED_M],
                "learner": LEARNERS[int(status.settings[Setting.LEARNER])],
                "adaptation": bool(status.settings[Setting.ADAPTATION]),
            },
        }
        begun = encoded(told)[:-1]
        yield
        axes = b",".join(self._axis(place, axis) for place, axis in enumerate(status.axes))
        return _joined(
            begun,
            bus=figures.bus,
            axes=b"[%b]" % axes,
            nodes=figures.nodes,
            emcy=figures.emcy,
            events=figures.events,
        )

    def _axis(self, place: int, axis: AxisStatus) -> bytes:
        told = {
            "name": axis.name,
            "compensation_enabled": axis.compensation_enabled,
            "observer_enabled": axis.observer_enabled,
            "learning_due": axis.learning_due,
            "reversals": axis.reversals,
            "last": None if axis.last is None else _report(axis.last),
            "version": axis.version,
            "learned_at": axis.learned_at,
        }
        learned = _kept(self._learned, place, axis.learned, _functions)
        screw = _kept(self._screws, place, axis.screw, _screw)
        return _joined(encoded(told)[:-1], learned=learned, screw=screw) + b"}"


def _kept(store: dict[int, tuple[Any, bytes]], place: int, source: Any, tell: Callable[[Any], Any]) -> bytes:
    """What `tell` makes of `source`, encoded anew only when that is another one."""
    kept = store.get(place)
    if kept is None or kept[0] != source:
        kept = store[place] = source, encoded(tell(source))
    return kept[1]


def _joined(begun: bytes, **parts: bytes) -> bytes:
    """An object that was begun, with parts that are JSON already; not closed."""
    return begun + b"".join(b',"%b":%b' % (name.encode(), part) for name, part in parts.items())


def with_missed(status: bytes, rows_missed: int) -> bytes:
    """The status as one client gets it."""
    return b'%b,"rows_missed":%d}' % (status, rows_missed)


def reversal(
    report: ReversalReport, axis: str, trace_m: NDArray[Any] | Iterable[float], period_s: float
) -> bytes:
    """A reversal and its error trace."""
    told = {
        "kind": "reversal",
        "axis": axis,
        "report": _report(report),
        "period_s": period_s,
        "error_m": [_number(float(error_m)) for error_m in trace_m],
    }
    return encoded(told)


def encoded(content: Any) -> bytes:
    """As JSON travels here: ASCII, no spaces, no NaN."""
    return json.dumps(content, allow_nan=False, separators=(",", ":")).encode("ascii")


def _learning(learning: LearningStatus) -> dict[str, Any]:
    outlook = learning.outlook
    done, total = (0, 0) if outlook is None else (outlook.strokes_done, outlook.strokes_total)
    return {
        "state": LearningState(learning.state).name.lower(),
        "axis": learning.axis,
        "reason": learning.reason,
        "stage": "" if outlook is None else outlook.stage,
        "strokes_done": done,
        "strokes_total": total,
        "progress": min(1.0, done / max(total, 1)),
        "remaining_s": None if outlook is None else _number(outlook.remaining_s),
        "acceleration_m_s2": None if outlook is None else _number(outlook.acceleration_m_s2),
        "best_m": None if outlook is None else _number(outlook.best_m),
    }


def _drive(drive: DriveStatus) -> dict[str, Any]:
    return {**drive._asdict(), "position_m": _number(drive.position_m)}


def _report(report: ReversalReport) -> dict[str, Any]:
    return {
        "cycle": report.cycle,
        "direction": report.direction,
        "acceleration_m_s2": _number(report.acceleration_m_s2),
        "contour_peak_m": _number(report.contour_peak_m),
        "error_peak_m": _number(report.error_peak_m),
        "error_rms_m": _number(report.error_rms_m),
        "error_mean_m": _number(report.error_mean_m),
    }


def _functions(learned: Learned | None) -> dict[str, Any] | None:
    if learned is None:
        return None
    return {
        "learner": learned.learner,
        "durations": learned.durations,
        "amplitudes": learned.amplitudes,
        "trailing": learned.trailing,
        "spread_m_s2": _number(learned.spread_m_s2),
        "before_m": _number(learned.before_m),
        "after_m": _number(learned.after_m),
        "strokes": learned.strokes,
        "machine_time_s": _number(learned.machine_time_s),
    }


def _screw(screw: ScrewStatus) -> dict[str, Any]:
    learned = screw.learned
    return {
        "enabled": screw.enabled,
        "version": screw.version,
        "learned_at": screw.learned_at,
        "points": () if learned is None else learned.points,
        "lost_motion_m": None if learned is None else _number(learned.lost_motion_m),
        "before_m": None if learned is None else _number(learned.before_m),
        "after_m": None if learned is None else _number(learned.after_m),
    }


def _number(value: float) -> float | None:
    """None for what is no number."""
    return value if math.isfinite(value) else None
