"""The status as JSON for the local socket: `commands.machine_status` and the figures of the bus.

Made in the thread of the cycle ten times a second, so in pieces. What changes rarely and is long (learned
functions) is encoded once.
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
    """The part of a status that describes the bus, JSON already; see `daemon.page.bus_watch`."""

    bus: bytes
    nodes: bytes
    emcy: bytes
    events: bytes


AT_ONCE = sorted(set(MachineStatus._fields) - {"time", "axes", "rows_missed", *BusFigures._fields})
"""Fields of the status that are encoded in the first piece."""


class StatusEncoder:
    """Remembers what it has encoded of the learned results."""

    def __init__(self) -> None:
        self._kept: dict[tuple[int, str], tuple[Any, bytes]] = {}

    def pieces(self, status: MachineStatus, figures: BusFigures) -> Generator[None, None, bytes]:
        """A status without `rows_missed`, which is each client's own, and without the closing brace."""
        first = {
            "kind": "status",
            "time": datetime.now(UTC).isoformat(timespec="milliseconds"),
            **{name: to_plain(getattr(status, name)) for name in AT_ONCE},
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
        """A field of an axis, encoded again only when its value is another one."""
        kept = self._kept.get((place, name))
        if kept is None or kept[0] != value:
            kept = self._kept[place, name] = value, plain_json(to_plain(value))
        return kept[1]


def with_missed(status: bytes, rows_missed: int) -> bytes:
    """The status as one client gets it."""
    return b'%b,"rows_missed":%d}' % (status, rows_missed)


def _joined(head: bytes, **parts: bytes) -> bytes:
    """An object without its closing brace, and with further parts that are JSON already."""
    return head + b"".join(b',"%b":%b' % (name.encode(), part) for name, part in parts.items())
