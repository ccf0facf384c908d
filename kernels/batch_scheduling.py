"""The scheduling policy SCHED_BATCH for a process that exchanges bursts of frames in lockstep.

Under it a process wakes up after a burst and not at its first frame: nothing is late in lockstep, and every
wake-up costs processor time.
"""

import contextlib
import os
from collections.abc import Iterator


@contextlib.contextmanager
def batch_scheduling() -> Iterator[None]:
    """Run the block as SCHED_BATCH, then restore SCHED_OTHER.

    Nothing changes under any other policy, where a sandbox forbids the change, and outside Linux.
    """
    changed = False
    if hasattr(os, "SCHED_BATCH") and os.sched_getscheduler(0) == os.SCHED_OTHER:
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
            changed = True
    try:
        yield
    finally:
        if changed:
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
