"""Processors for what is measured: they do not go idle, and what stands for a drive goes first.

A processor that has gone to sleep wakes up late, in a virtual machine by a millisecond and more, and whatever
else runs keeps it awake: without this a busy computer seems to be the more punctual one.
"""

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from kernels.thread_priority import BACKGROUND_PRIORITY

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
def undisturbed(*, favour: bool = True) -> Iterator[bool]:
    """Processors awake for the block, children that run already favoured if wished; whether they are."""
    favoured = favour and favour_children()
    with processors_awake():  # not favoured: started afterwards
        yield favoured


def favour_children() -> bool:
    """Give what we have started so far the processor before anybody ordinary; False where not permitted.

    The priority is that of the recorder's thread: a higher one would keep that from letting go of what the
    cycle waits for.
    """
    ours, favoured = str(os.getpid()), os.sched_param(BACKGROUND_PRIORITY)
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            if stat.read_text().rpartition(")")[2].split()[1] == ours:
                for thread in stat.parent.glob("task/*"):
                    try:
                        os.sched_setscheduler(int(thread.name), os.SCHED_FIFO, favoured)
                    except PermissionError:
                        return False
    return True


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
