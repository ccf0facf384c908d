"""Encodes the status for the local socket in JSON: `commands.machine_status` and the figures of the bus.

The thread of the cycle encodes it ten times a second, so it works in pieces. Long values that change rarely
(learned functions) are encoded only when they change.
"""

from collections.abc import Generator
from datetime import UTC, datetime
from typing import Any, NamedTuple

from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.local_codec import published_names, to_plain
from servo_ctrl.commands.local_messages import plain_json
from servo_ctrl.commands.machine_status import MachineStatus

LEARNED = ("learned", "screw")
"""Fields of an axis that are long and change rarely."""


class BusFigures(NamedTuple):
    """The part of a status about the bus, already in JSON; see `daemon.page.bus_watch`."""

    bus: bytes
    nodes: bytes
    emcy: bytes
    events: bytes


FIRST_PIECE = sorted(set(MachineStatus._fields) - {"time", "axes", "rows_missed", *BusFigures._fields})
"""Fields of the status in the first piece."""


class StatusEncoder:
    """Encodes statuses, and keeps the encoded learned results."""

    def __init__(self) -> None:
        self._kept: dict[tuple[int, str], tuple[Any, bytes]] = {}

    def pieces(self, status: MachineStatus, figures: BusFigures) -> Generator[None, None, bytes]:
        """Encode a status without the closing brace and without `rows_missed`, which differs by client."""
        first = {
            "kind": "status",
            "time": datetime.now(UTC).isoformat(timespec="milliseconds"),
            **{name: to_plain(getattr(status, name)) for name in FIRST_PIECE},
        }
        head = plain_json(first)[:-1]
        yield
        axes = b",".join(self._axis(place, axis) for place, axis in enumerate(status.axes))
        return _joined(head, axes=b"[%b]" % axes, **figures._asdict())

    def _axis(self, place: int, axis: AxisStatus) -> bytes:
        names = (name for name in published_names(AxisStatus) if name not in LEARNED)
        head = plain_json({name: to_plain(getattr(axis, name)) for name in names})[:-1]
        learned = {name: self._encoded_once(place, name, getattr(axis, name)) for name in LEARNED}
        return _joined(head, **learned) + b"}"

    def _encoded_once(self, place: int, name: str, value: Any) -> bytes:
        """Return an encoded field of an axis, encoded again only if its value has changed."""
        kept = self._kept.get((place, name))
        if kept is None or kept[0] != value:
            kept = self._kept[place, name] = value, plain_json(to_plain(value))
        return kept[1]


def with_missed(status: bytes, rows_missed: int) -> bytes:
    """Complete an encoded status for one client."""
    return b'%b,"rows_missed":%d}' % (status, rows_missed)


def _joined(head: bytes, **parts: bytes) -> bytes:
    """Append encoded parts to an object without its closing brace."""
    return head + b"".join(b',"%b":%b' % (name.encode(), part) for name, part in parts.items())
