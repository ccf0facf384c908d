"""Notes when an input file of a run changes during the run, which continues with the contents it has read.

A thread of its own reads the disk, because a disk may hang.
"""

import asyncio
import contextlib
import threading
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.config.model import MachineConfig

POLL_S = 1.0
"""Interval at which the files are compared; chosen."""
END_LIMIT_S = 0.2
"""Bounds the wait at the end of a run for a hanging disk; chosen."""


@contextlib.contextmanager
def changes_noted(
    config: MachineConfig, plans: Iterable[NodePlan], note: Callable[[str], None]
) -> Iterator[None]:
    """While the block runs, call `note` in the running loop once for every changed or missing file."""
    loop, over = asyncio.get_running_loop(), threading.Event()
    paths = [config.source, config.controller.eds, *(plan.eds.path for plan in plans)]
    first = {path: _identity(path) for path in dict.fromkeys(paths)}

    def compare() -> None:
        while first and not over.wait(POLL_S):
            for path in [path for path, before in first.items() if _identity(path) != before]:
                del first[path]
                text = f"{path} was changed during the run, which continues with the content that it has read"
                with contextlib.suppress(RuntimeError):  # the loop has ended meanwhile
                    loop.call_soon_threadsafe(note, text)

    watcher = threading.Thread(target=compare, name="changed files", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        watcher.join(END_LIMIT_S)


def _identity(path: Path) -> tuple[int, int, int] | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_ino, status.st_size, status.st_mtime_ns
