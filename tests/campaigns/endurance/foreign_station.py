"""A foreign station on the bus: sends frames of low priority at a set rate of bits.

Run as `python -m tests.campaigns.endurance.foreign_station SOCKET BITS_PER_S`. It responds to
each line on its input with the counts of sent frames; "rate N" changes the rate. The data of the frames vary,
and each frame counts with its own stuff bits, so that the sum of sent bits follows rate x time. It receives
nothing.
"""

import json
import os
import random
import select
import sys
import time

from local_can.wire import FRAME, FRAME_BYTES, frame_bits
from tests.campaigns.endurance.counting_station import attached_socket

LOWEST_PRIORITY = range(0x7E0, 0x7F0)
"""Identifiers above all those of the pre-defined connection set (CiA 301) that the table uses."""
FRAMES = 4096
"""Number of different frames, sent in turn; chosen."""
LEAD_S = 0.001
"""Time by which frames are sent to the hub in advance, seconds; the hub delays each until the bus is free."""
BACKLOG_MAX_S = 0.05
"""Bounds the backlog that is sent later in a burst, seconds; chosen."""


def random_frames(seed: int) -> list[tuple[bytes, int]]:
    """Return random frames, and the bits of each on the wire."""
    rng = random.Random(seed)
    frames = []
    for _ in range(FRAMES):
        data = rng.randbytes(8)
        frame = FRAME.pack(rng.choice(LOWEST_PRIORITY), len(data), 0, data)
        frames.append((frame, frame_bits(frame)))
    return frames


def main(path: str, bits_per_s: float) -> None:
    """Send until the input ends."""
    bus = attached_socket(path, ())
    bus.setblocking(True)
    frames = random_frames(8)
    sent = bits = skipped_bits = 0
    origin_s, due_bits = time.monotonic(), 0.0
    while True:
        wait_s = origin_s + due_bits / bits_per_s - time.monotonic() if bits_per_s > 0.0 else 1.0
        readable, _, _ = select.select([sys.stdin, bus], [], [], max(wait_s, 0.0))
        if bus in readable and not bus.recv(FRAME_BYTES):
            return  # the hub has ended
        if sys.stdin in readable:
            command = os.read(sys.stdin.fileno(), 4096).split()
            if not command:
                return
            if command[0] == b"rate":
                bits_per_s, origin_s, due_bits = float(command[1]), time.monotonic(), 0.0
            print(json.dumps({"frames": sent, "bits": bits, "forgone_bits": skipped_bits}), flush=True)
        elif bits_per_s > 0.0:
            now_s = time.monotonic()
            backlog_s = now_s - origin_s - due_bits / bits_per_s
            if backlog_s > BACKLOG_MAX_S:
                origin_s += backlog_s
                skipped_bits += round(backlog_s * bits_per_s)
            while due_bits <= (now_s + LEAD_S - origin_s) * bits_per_s:
                frame, size = frames[sent % FRAMES]
                bus.send(frame)
                sent, bits, due_bits = sent + 1, bits + size, due_bits + size


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
