"""A hub that passes a SYNC on in real time and all other frames at once.

The hub of `python -m local_can --bitrate` sleeps once a frame: under the operator's day 46 s of processor
time where this one takes 16 s. Arguments: the path of the socket and the SYNC period in microseconds.
"""

import contextlib
import signal
import sys
import time
from pathlib import Path

from local_can.hub import Hub
from local_can.port import Client
from local_can.wire import FRAME_BYTES, headers_of

SYNC = 0x80
"""Identifier by CiA 301."""


class PacedHub(Hub):
    """Takes a SYNC one period after the last one, at the earliest."""

    def __init__(self, path: Path, period_s: float) -> None:
        super().__init__(path, bitrate=0, queue_frames=16384, patience_s=0.25)
        self._period_s, self._due_s = period_s, 0.0

    def take(self, client: Client, packet: bytes) -> bool:
        """Take a packet; one with a SYNC when it is due."""
        if len(packet) % FRAME_BYTES == 0 and SYNC in headers_of(packet):
            now_s = time.monotonic()
            if now_s < self._due_s:
                time.sleep(self._due_s - now_s)
            self._due_s = max(now_s, self._due_s) + self._period_s
        return super().take(client, packet)


def main() -> None:
    """Serve until a signal."""
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: sys.exit(0))
    path, period_us = sys.argv[1:]
    with contextlib.closing(PacedHub(Path(path), float(period_us) * 1e-6)) as hub:
        hub.run()


if __name__ == "__main__":
    main()
