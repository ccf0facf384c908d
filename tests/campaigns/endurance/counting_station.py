"""An observer on the bus: counts frames and their bits by identifier, and measures the gaps between SYNCs.

Run as `python -m tests.campaigns.endurance.counting_station SOCKET`. It responds to each line on its input
with a line of JSON; "begin" resets the counts. It reads the 16-byte frames of the hub itself, so that its
counts are independent of those of controller and simulator.

It has two sockets. One receives only SYNC and wakes the process; the other receives all frames and is read
after each SYNC. Waking up for each frame of a full bus would take processor time from the observed processes.
"""

import json
import os
import selectors
import socket
import sys
import time
from collections.abc import Callable
from typing import Any

from local_can.wire import (
    ATTACH,
    ATTACHED,
    EXTENDED,
    FRAME,
    FRAME_BYTES,
    PASS_ALL,
    STANDARD_ID_MASK,
    Filters,
    frame_bits,
    lost_frames,
    pack_filters,
)

SYNC = 0x080
SYNC_ALONE: Filters = ((SYNC, STANDARD_ID_MASK | EXTENDED),)
POLL_S = 0.01
"""Poll interval while no SYNC arrives, seconds; chosen."""
GAP_BINS_MS = (1.5, 2.5, 5.5, 10.5, 20.5, 50.5)
"""Edges of the histogram of the gaps between SYNCs; chosen: between whole periods of 1 ms."""


class BusCounts:
    """Counts of the frames on the bus since `begin`."""

    def __init__(self) -> None:
        self.frames: dict[int, int] = {}
        self.bits = 0
        self.lost = 0
        """Frames that the hub could not deliver to this station; if any, the counts are incomplete."""
        self.first_sync_s = self.last_sync_s = 0.0
        self.sync_bits = 0
        """Bits from the first SYNC to the last one."""
        self.longest_gap_s = 0.0
        self.gaps = [0] * (len(GAP_BINS_MS) + 1)
        self.start_s = time.monotonic()
        self._bits_at_first_sync: int | None = None

    def add_frame(self, frame: bytes) -> None:
        """Count a frame of the hub, 16 bytes."""
        header, size, _, data = FRAME.unpack(frame)
        if lost := lost_frames(header, data[:size]):
            self.lost += lost
            return
        can_id = header & ~EXTENDED
        self.frames[can_id] = self.frames.get(can_id, 0) + 1
        self.bits += frame_bits(frame)
        if can_id == SYNC:
            if self._bits_at_first_sync is None:
                self._bits_at_first_sync = self.bits
            self.sync_bits = self.bits - self._bits_at_first_sync

    def add_sync(self, now_s: float) -> None:
        """Count the gap before a SYNC that arrived at `now_s`."""
        if self.last_sync_s:
            gap_s = now_s - self.last_sync_s
            self.longest_gap_s = max(self.longest_gap_s, gap_s)
            self.gaps[sum(gap_s * 1e3 > edge for edge in GAP_BINS_MS)] += 1
        else:
            self.first_sync_s = now_s
        self.last_sync_s = now_s

    def as_json(self) -> dict[str, Any]:
        return {
            "frames": {f"{can_id:03X}": count for can_id, count in sorted(self.frames.items())},
            "bits": self.bits,
            "lost": self.lost,
            "seconds": time.monotonic() - self.start_s,
            "sync_bits": self.sync_bits,
            "sync_seconds": self.last_sync_s - self.first_sync_s,
            "longest_sync_gap_ms": 1e3 * self.longest_gap_s,
            "sync_gaps_above_ms": dict(zip(map(str, (0.0, *GAP_BINS_MS)), self.gaps, strict=True)),
        }


def attached_socket(path: str, filters: Filters) -> socket.socket:
    """Return a client socket of the hub that receives the frames that pass the filters."""
    client = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    client.connect(path)
    client.send(pack_filters(filters))
    client.send(ATTACH)
    while client.recv(FRAME_BYTES) != ATTACHED:
        pass
    client.setblocking(False)
    return client


def main(path: str) -> None:
    """Count until the input or the hub ends."""
    # attached first: it has each SYNC when `sync_socket` has it
    frame_socket = attached_socket(path, PASS_ALL)
    sync_socket = attached_socket(path, SYNC_ALONE)
    counts = BusCounts()

    def receive_all() -> bool:
        return _receive_pending(
            sync_socket, lambda _: counts.add_sync(time.monotonic())
        ) and _receive_pending(frame_socket, counts.add_frame)

    with selectors.DefaultSelector() as selector:
        selector.register(sync_socket, selectors.EVENT_READ)
        selector.register(sys.stdin, selectors.EVENT_READ)
        while receive_all():
            if any(key.fileobj is sys.stdin for key, _ in selector.select(POLL_S)):
                commands = os.read(sys.stdin.fileno(), 4096)
                if not commands:
                    return
                receive_all()
                if b"begin" in commands:
                    counts = BusCounts()
                print(json.dumps(counts.as_json()), flush=True)


def _receive_pending(bus: socket.socket, add_frame: Callable[[bytes], None]) -> bool:
    """Pass all received frames to `add_frame`; return False when the hub has ended."""
    try:
        while frame := bus.recv(FRAME_BYTES):
            add_frame(frame)
    except BlockingIOError:
        return True
    except ConnectionError:
        pass
    return False


if __name__ == "__main__":
    main(sys.argv[1])
