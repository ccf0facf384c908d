"""Encodes the payloads of the MQTT topics: JSON with the unit in every key. docs/mqtt.md is the reference.

Errors are in micrometres, accelerations in mm/s^2, as in the machine file and the papers. An unknown quantity
is null. The keys follow from the declarations in `servo_ctrl.commands`.
"""

import json
import math
from datetime import UTC, datetime
from enum import Enum
from typing import Any

from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.field import FIELDS_OF, Field, topic_unit
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.learning.types import ReversalReport

ONLINE, OFFLINE = b"online", b"offline"


def state_payload(status: MachineStatus, reversals_dropped: int) -> bytes:
    """Encode the state of the whole machine, without the learned functions."""
    return _encoded({**state_document(status), "reversals_dropped": reversals_dropped})


def state_document(status: MachineStatus) -> dict[str, Any]:
    """Return the state of the whole machine as a document."""
    axes = {axis.name: to_document(axis) for axis in status.axes}
    return {**_moment(status.cycles), **to_document(status), "axis": axes}


def reversal_payload(report: ReversalReport, noted: datetime) -> bytes:
    """Encode the indicators of one reversal; `cycle` is that of the reversal."""
    return _encoded({**_moment(report.cycle, noted), **to_document(report)})


def due_payload(cycle: int, *, due: bool) -> bytes:
    """Encode whether learning was due for an axis in this cycle."""
    return _encoded({**_moment(cycle), "due": due})


def learned_payload(cycle: int, axis: AxisStatus) -> bytes:
    """Encode the learned functions in use by an axis; `functions` is null without."""
    version = {"version": axis.version, "learned_at": axis.learned_at or None}
    return _encoded({**_moment(cycle), **version, "functions": functions_document(axis)})


def functions_document(axis: AxisStatus) -> dict[str, Any] | None:
    """Return the learned functions of an axis, point by point; None without."""
    return None if axis.learned is None else to_document(axis.learned)


def ack_payload(cycle: int, request_id: str | None, refusal: str, reason: str) -> bytes:
    """Encode the answer to a command; `refusal` is "none" when accepted."""
    answer = {"id": request_id, "accepted": refusal == "none", "refusal": refusal, "reason": reason}
    return _encoded({**_moment(cycle), **answer})


def to_document(status: Any) -> dict[str, Any]:
    """Convert a status type to the keys and units of the topics."""
    document = {}
    for name, field in FIELDS_OF[type(status)].items():
        if field.mqtt is not None and (not field.part or getattr(status, field.part)):
            key, factor = topic_unit(name)
            document[field.mqtt or key] = _encodable(getattr(status, name), field, factor)
    return document


def _encodable(value: Any, field: Field, factor: float) -> Any:
    if field.columns:
        return [
            {key: _scaled(part, 1e3) for key, part in zip(field.columns, row, strict=True)} for row in value
        ]
    if isinstance(value, float):
        return _scaled(value, factor, field.digits)
    if isinstance(value, Enum):
        return value.name.lower()
    if isinstance(value, tuple):
        return to_document(value)
    return None if field.null and not value else value


def _moment(cycle: int, time: datetime | None = None) -> dict[str, Any]:
    return {"time": (time or datetime.now(UTC)).isoformat(timespec="milliseconds"), "cycle": cycle}


def _scaled(value: float, factor: float, digits: int = 6) -> float | None:
    """Return a value in the unit of the topic; None (null) for NaN and infinity."""
    return round(value * factor, digits) if math.isfinite(value) else None


def _encoded(content: dict[str, Any]) -> bytes:
    return json.dumps(content, allow_nan=False, separators=(",", ":")).encode("ascii")
