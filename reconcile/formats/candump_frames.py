"""Frames of a log as `candump -L` and `candump -l` write it: `(1436509052.249713) can0 181#2702A0860100`."""

import re
from array import array
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reconcile.errors import ReconcileError

SYNC = 0x80
SDO_REQUEST = 0x600
EXPEDITED_BYTES = {0x23: 4, 0x27: 3, 0x2B: 2, 0x2F: 1}
"""Command specifier of an expedited SDO download -> bytes of its value."""
CONFIGURATION = range(0x1400, 0x1C00)
FRAME = re.compile(rb"^\((\d+\.\d+)\)\s+(\S+)\s+([0-9A-Fa-f]{3})#((?:[0-9A-Fa-f]{2})*)", re.MULTILINE)


class Frames(NamedTuple):
    """A log sorted by identifier."""

    sync_s: NDArray[np.float64]
    """Stamps of the SYNCs, from the first."""
    payloads: dict[int, dict[int, bytes]]
    """Identifier -> SYNC period -> last payload in it."""
    written: dict[int, dict[tuple[int, int], int]]
    """Node -> (index, subindex) -> value: what SDO downloads wrote into its PDO parameters."""


def read_frames(path: Path) -> Frames:
    """All classic data frames with 11-bit identifiers. Raises ReconcileError."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ReconcileError(path, "", error.strerror or "cannot be read") from error
    stamps = array("d")
    payloads: dict[int, dict[int, bytes]] = {}
    written: dict[int, dict[tuple[int, int], int]] = {}
    buses: set[bytes] = set()
    period = -1
    for frame in FRAME.finditer(content):
        stamp, bus, identifier, data = frame.groups()
        cob_id = int(identifier, 16)
        buses.add(bus)
        if cob_id == SYNC:
            period += 1
            stamps.append(float(stamp))
        elif SDO_REQUEST < cob_id <= SDO_REQUEST + 0x7F:
            _note_download(written.setdefault(cob_id - SDO_REQUEST, {}), bytes.fromhex(data.decode()))
        elif period >= 0:
            payloads.setdefault(cob_id, {})[period] = bytes.fromhex(data.decode())
    if not buses:
        first = content.split(b"\n", 1)[0][:60].decode("utf-8", "replace")
        reason = f"is no line of `candump -L`: {first!r}"
        if "##" in first:
            reason = "is a CAN FD frame, and none of the log is classic CAN as CANopen's are"
        raise ReconcileError(path, "line 1", reason, "record with candump -L")
    if len(buses) > 1:
        names = ", ".join(sorted(bus.decode("utf-8", "replace") for bus in buses))
        raise ReconcileError(path, "", f"holds several buses: {names}", "keep one of them (grep)")
    if len(stamps) < 2:
        reason = "has no SYNC (080h), which says when the inputs were latched"
        raise ReconcileError(path, "", reason, "record the whole bus")
    sync_s = np.frombuffer(stamps, dtype=np.float64)
    return Frames(sync_s - sync_s[0], payloads, written)


def _note_download(written: dict[tuple[int, int], int], data: bytes) -> None:
    if len(data) != 8 or data[0] not in EXPEDITED_BYTES:
        return
    index, subindex = int.from_bytes(data[1:3], "little"), data[3]
    if index in CONFIGURATION:
        size = EXPEDITED_BYTES[data[0]]
        written[index, subindex] = int.from_bytes(data[4 : 4 + size], "little")
