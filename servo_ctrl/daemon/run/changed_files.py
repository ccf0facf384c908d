"""Files that a run was made from, and that somebody changes while it goes on: told, and not followed.

What was read is in force until the run ends. The disk is asked in a thread of its own, for it may hang.
"""

import asyncio
import contextlib
import threading
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from servo_ctrl.canopen.plan import NodePlan
from servo_ctrl.config.model import MachineConfig

LOOK_S = 1.0
END_S = 0.2
"""How long the end of a run waits for a look at a disk that hangs."""
Seen = tuple[int, int, int] | None


@contextlib.contextmanager
def changes_told(
    config: MachineConfig, plans: Iterable[NodePlan], note: Callable[[str], None]
) -> Iterator[None]:
    """While the block runs, tell `note` (in the running loop) once of every file that is changed or gone."""
    loop, over = asyncio.get_running_loop(), threading.Event()
    paths = [config.source, config.controller.eds, *(plan.eds.path for plan in plans)]
    first = {path: _seen(path) for path in dict.fromkeys(paths)}

    def look() -> None:
        while first and not over.wait(LOOK_S):
            for path in [path for path, seen in first.items() if _seen(path) != seen]:
                del first[path]
                text = f"{path} was changed under way: the run goes on with what it has read"
                with contextlib.suppress(RuntimeError):  # the loop has ended meanwhile
                    loop.call_soon_threadsafe(note, text)

    watcher = threading.Thread(target=look, name="changed files", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        watcher.join(END_S)


def _seen(path: Path) -> Seen:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns
