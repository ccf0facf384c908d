"""A station that is none of ours: fills the bus with frames of low priority, bit by bit to a set rate.

Run as `python -m tests.campaigns.endurance.foreign_station SOCKET BITS_PER_S`. A line on its input is
answered with what was sent so far; "rate N" sets another rate. The frames change from one to the next, and
each counts with its own stuff bits: the sum of sent bits follows rate x time, whatever a single frame weighs.
It receives nothing.
"""

import json
import os
import random
import select
import sys
import time

from local_can.wire import FRAME, FRAME_BYTES, frame_bits
from tests.campaigns.endurance.counting_station import attached

LOWEST_PRIORITY = range(0x7E0, 0x7F0)
"""Above every identifier of CANopen's predefined set that the table uses, below its boot-up and LSS."""
PREPARED = 4096
AHEAD_S = 0.001
"""Frames are handed over so early, some at one go; the hub makes each wait for the bus."""
BEHIND_S = 0.05
"""What could not be sent for longer than this is not made up for in a burst."""


def prepared(seed: int) -> list[tuple[bytes, int]]:
    """Frames and their bits on the wire."""
    drawn = random.Random(seed)
    frames = []
    for _ in range(PREPARED):
        data = drawn.randbytes(8)
        frame = FRAME.pack(drawn.choice(LOWEST_PRIORITY), len(data), 0, data)
        frames.append((frame, frame_bits(frame)))
    return frames


def main(path: str, bits_per_s: float) -> None:
    """Send until the input ends."""
    bus = attached(path, ())
    bus.setblocking(True)
    frames = prepared(8)
    sent = bits = forgone = 0
    origin_s, due_bits = time.monotonic(), 0.0
    while True:
        wait_s = origin_s + due_bits / bits_per_s - time.monotonic() if bits_per_s > 0.0 else 1.0
        readable, _, _ = select.select([sys.stdin, bus], [], [], max(wait_s, 0.0))
        if bus in readable and not bus.recv(FRAME_BYTES):
            return  # the hub has ended
        if sys.stdin in readable:
            words = os.read(sys.stdin.fileno(), 4096).split()
            if not words:
                return
            if words[0] == b"rate":
                bits_per_s, origin_s, due_bits = float(words[1]), time.monotonic(), 0.0
            print(json.dumps({"frames": sent, "bits": bits, "forgone_bits": forgone}), flush=True)
        elif bits_per_s > 0.0:
            now_s = time.monotonic()
            behind_s = now_s - origin_s - due_bits / bits_per_s
            if behind_s > BEHIND_S:
                origin_s += behind_s
                forgone += round(behind_s * bits_per_s)
            while due_bits <= (now_s + AHEAD_S - origin_s) * bits_per_s:
                frame, size = frames[sent % PREPARED]
                bus.send(frame)
                sent, bits, due_bits = sent + 1, bits + size, due_bits + size


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
