"""A witness on the bus: counts frames and their bits by identifier, and looks at the gaps between SYNCs.

Run as `python -m tests.campaigns.endurance.counting_station SOCKET`. A line on its input is answered with a
line of JSON; "begin" forgets what was counted. It reads the hub's 16-byte frames themselves: nothing of the
controller's or the simulator's own counting is in it.

It has two sockets. One receives SYNC alone, and its time; the other receives everything, and is read when a
SYNC has come. Waking up for each frame of a full bus would take the processor from those who are watched.
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
READ_S = 0.01
"""So often all is read where no SYNC comes."""
GAP_BINS_MS = (1.5, 2.5, 5.5, 10.5, 20.5, 50.5)


class Counts:
    """What has passed since `begin`."""

    def __init__(self) -> None:
        self.frames: dict[int, int] = {}
        self.bits = 0
        self.lost = 0
        """Frames that the hub could not hand to us: then the counts are no witness."""
        self.first_sync_s = self.last_sync_s = 0.0
        self.sync_bits = 0
        """Bits from the first SYNC to the last."""
        self.longest_gap_s = 0.0
        self.gaps = [0] * (len(GAP_BINS_MS) + 1)
        self.began_s = time.monotonic()
        self._bits_before: int | None = None

    def take(self, frame: bytes) -> None:
        """One frame of all."""
        header, size, _, data = FRAME.unpack(frame)
        if lost := lost_frames(header, data[:size]):
            self.lost += lost
            return
        can_id = header & ~EXTENDED
        self.frames[can_id] = self.frames.get(can_id, 0) + 1
        self.bits += frame_bits(frame)
        if can_id == SYNC:
            if self._bits_before is None:
                self._bits_before = self.bits
            self.sync_bits = self.bits - self._bits_before

    def beat(self, now_s: float) -> None:
        """A SYNC has arrived."""
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
            "seconds": time.monotonic() - self.began_s,
            "sync_bits": self.sync_bits,
            "sync_seconds": self.last_sync_s - self.first_sync_s,
            "longest_sync_gap_ms": 1e3 * self.longest_gap_s,
            "sync_gaps_above_ms": dict(zip(map(str, (0.0, *GAP_BINS_MS)), self.gaps, strict=True)),
        }


def attached(path: str, filters: Filters) -> socket.socket:
    """A client of the hub that receives the frames that pass the filters."""
    client = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    client.connect(path)
    client.send(pack_filters(filters))
    client.send(ATTACH)
    while client.recv(FRAME_BYTES) != ATTACHED:
        pass
    client.setblocking(False)
    return client


def main(path: str) -> None:
    """Count until the input ends, or the hub."""
    everything = attached(path, PASS_ALL)  # attached first: a SYNC is here when `beats` gets it
    beats = attached(path, SYNC_ALONE)
    counts = Counts()

    def hear() -> bool:
        return _drained(beats, lambda _: counts.beat(time.monotonic())) and _drained(everything, counts.take)

    with selectors.DefaultSelector() as selector:
        selector.register(beats, selectors.EVENT_READ)
        selector.register(sys.stdin, selectors.EVENT_READ)
        while hear():
            if any(key.fileobj is sys.stdin for key, _ in selector.select(READ_S)):
                words = os.read(sys.stdin.fileno(), 4096)
                if not words:
                    return
                hear()
                if b"begin" in words:
                    counts = Counts()
                print(json.dumps(counts.as_json()), flush=True)


def _drained(bus: socket.socket, take: Callable[[bytes], None]) -> bool:
    """Take what is there; False when the hub has ended."""
    try:
        while frame := bus.recv(FRAME_BYTES):
            take(frame)
    except BlockingIOError:
        return True
    except ConnectionError:
        pass
    return False


if __name__ == "__main__":
    main(sys.argv[1])
