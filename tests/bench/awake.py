"""Processors that do not go idle while ticks are measured.

A processor that has gone to sleep wakes up late, in a virtual machine by a millisecond and more, and whatever
else runs keeps it awake: without this a busy computer seems to be the more punctual one.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

SPIN = """
import contextlib, os, sys
os.setsid()
with contextlib.suppress(OSError), open("/proc/self/autogroup", "w") as group:
    group.write("19")  # Linux shares processors among sessions first, and the idle ones of each afterwards
os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
os.sched_setaffinity(0, {int(sys.argv[1])})
parent = os.getppid()
while os.getppid() == parent:
    for _ in range(1_000_000): pass
"""


@contextlib.contextmanager
def processors_awake() -> Iterator[None]:
    """On every processor that is ours something runs that gives way to everything else (SCHED_IDLE)."""
    spinning = [
        subprocess.Popen([sys.executable, "-c", SPIN, str(processor)])
        for processor in os.sched_getaffinity(0)
    ]
    try:
        yield
    finally:
        for process in spinning:
            process.kill()
            process.wait()
