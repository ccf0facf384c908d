"""Frames of a log of `candump -L` or `candump -l`: `(1436509052.249713) can0 181#2702A0860100`.

python-can reads the lines; other lines are skipped, because a log may end in the middle of a line.
"""

import contextlib
import math
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.lean_import import as_if_absent
from reconcile.errors import ReconcileError

with as_if_absent("asammdf"):  # python-can would load it, and pandas with it
    from can import Message
    from can.io.canutils import CanutilsLogReader

SYNC = 0x80
SDO_REQUEST = 0x600
EXPEDITED_BYTES = {0x23: 4, 0x27: 3, 0x2B: 2, 0x2F: 1}
"""Command specifier of an expedited SDO download -> bytes of its value."""
CONFIGURATION = range(0x1400, 0x1C00)
STANDARD_IDENTIFIERS = range(0x800)
CLASSIC_BYTES = 8


class Frames(NamedTuple):
    """A log sorted by identifier."""

    sync_s: NDArray[np.float64]
    """Time stamps of the SYNCs since the first one."""
    payloads: dict[int, dict[int, bytes]]
    """Identifier -> SYNC period -> last payload in it."""
    written: dict[int, dict[tuple[int, int], int]]
    """Node -> (index, subindex) -> value of the SDO downloads to its PDO parameters."""
    skipped_fd: int
    """Frames of CAN FD, which classic CANopen does not use."""


def read_frames(path: Path) -> Frames:
    """Read all classic data frames with 11-bit identifiers. Raises ReconcileError."""
    stamps = array("d")
    payloads: dict[int, dict[int, bytes]] = {}
    written: dict[int, dict[tuple[int, int], int]] = {}
    buses: set[str] = set()
    period, skipped_fd = -1, 0
    for frame in _frames(path):
        if frame.is_fd:
            skipped_fd += 1
            continue
        cob_id, data = frame.arbitration_id, bytes(frame.data)
        buses.add(str(frame.channel))
        if cob_id == SYNC:
            period += 1
            stamps.append(frame.timestamp)
        elif SDO_REQUEST < cob_id <= SDO_REQUEST + 0x7F:
            _note_download(written.setdefault(cob_id - SDO_REQUEST, {}), data)
        elif period >= 0:
            payloads.setdefault(cob_id, {})[period] = data
    if not buses:
        with path.open(encoding="utf-8", errors="replace") as log:
            first = log.readline(60).rstrip("\n")
        reason = f"is not a line of `candump -L`: {first!r}"
        if "##" in first:
            reason = "is a CAN FD frame, and none of the log is classic CAN as CANopen's are"
        raise ReconcileError(path, "line 1", reason, "record with candump -L")
    if len(buses) > 1:
        names = ", ".join(sorted(buses))
        raise ReconcileError(path, "", f"holds several buses: {names}", "keep one of them (grep)")
    if len(stamps) < 2:
        reason = "has no SYNC (080h), which says when the inputs were latched"
        raise ReconcileError(path, "", reason, "record the whole bus")
    sync_s = np.frombuffer(stamps, dtype=np.float64)
    return Frames(sync_s - sync_s[0], payloads, written, skipped_fd)


def _frames(path: Path) -> Iterator[Message]:
    """Yield the classic data frames with 11-bit identifiers, and all of CAN FD. Raises ReconcileError."""
    try:
        with path.open(encoding="utf-8", errors="replace") as log:
            reader, ended = CanutilsLogReader(log), False
            while not ended:
                with contextlib.suppress(ValueError, IndexError):  # raised at a line of another format
                    yield from filter(_is_used, reader)
                    ended = True
    except OSError as error:
        raise ReconcileError(path, "", error.strerror or "cannot be read") from error


def _is_used(frame: Message) -> bool:
    """Return whether it is a data frame of CAN 2.0A with a time stamp, or a CAN FD frame."""
    if frame.is_fd:
        return True
    special = frame.is_extended_id or frame.is_remote_frame or frame.is_error_frame
    fits = frame.arbitration_id in STANDARD_IDENTIFIERS and len(frame.data) <= CLASSIC_BYTES
    return fits and not special and math.isfinite(frame.timestamp)


def _note_download(written: dict[tuple[int, int], int], data: bytes) -> None:
    if len(data) != 8 or data[0] not in EXPEDITED_BYTES:
        return
    index, subindex = int.from_bytes(data[1:3], "little"), data[3]
    if index in CONFIGURATION:
        size = EXPEDITED_BYTES[data[0]]
        written[index, subindex] = int.from_bytes(data[4 : 4 + size], "little")
