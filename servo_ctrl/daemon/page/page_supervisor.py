"""Keeps the page's process alive: `python -m servo_ctrl.daemon.page.page_supervisor COMMAND...`.

It is a process of its own because a fork takes the controller longer than a tick. Supervisor and page end
when the supervisor's standard input ends: when the controller closes it or dies. The page writes to the
supervisor's standard output; the supervisor adds a line whenever the page ends.
"""

import ctypes
import os
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial

PR_SET_PDEATHSIG = 1
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.25, 10.0
STEADY_S = 30.0
"""A page that ran this long restarts after the first pause, and the count of restarts starts again."""
RESTARTS_MAX = 8
"""Consecutive restarts, each after less than `STEADY_S`. Chosen, like the other numbers."""
STOP_LIMIT_S = 3.0
ENDED = "the page has ended"
"""Start of the line that reports the end of the page."""


def main() -> int:
    """Run the command in the arguments, and restart it, until standard input ends."""
    command = sys.argv[1:]
    pause_s, consecutive = FIRST_PAUSE_S, 0
    while True:
        began_s = time.monotonic()
        status = _page(command)
        if status is None:
            return 0
        consecutive = 1 if time.monotonic() - began_s > STEADY_S else consecutive + 1
        pause_s = FIRST_PAUSE_S if consecutive == 1 else min(2.0 * pause_s, LONGEST_PAUSE_S)
        again = consecutive <= RESTARTS_MAX
        what = (
            f"again in {pause_s:g} s" if again else f"{consecutive} times in a row: it is not started again"
        )
        print(f"{ENDED} (status {status}), {what}", flush=True)  # noqa: T201  # the controller reads it
        if _input_ends(pause_s if again else None):
            return 0


def _page(command: list[str]) -> int | None:
    """Run the page once; return its exit status, or None if standard input ended."""
    page = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stderr=subprocess.STDOUT,
        preexec_fn=ends_with_its_parent(),  # noqa: PLW1509  # there are no threads here
    )
    over = os.pidfd_open(page.pid)
    try:
        with selectors.DefaultSelector() as selector:
            selector.register(0, selectors.EVENT_READ)
            selector.register(over, selectors.EVENT_READ)
            while page.poll() is None:
                ready = [key.fd for key, _ in selector.select()]
                if 0 in ready and not os.read(0, 4096):
                    _end(page)
                    return None
        return page.returncode
    finally:
        os.close(over)


def _end(page: subprocess.Popen[bytes]) -> None:
    page.terminate()
    try:
        page.wait(STOP_LIMIT_S)
    except subprocess.TimeoutExpired:
        page.kill()
        page.wait()


def _input_ends(within_s: float | None) -> bool:
    """Wait for the end of standard input, at most `within_s` (None: no limit); return whether it ended."""
    deadline_s = None if within_s is None else time.monotonic() + within_s
    with selectors.DefaultSelector() as selector:
        selector.register(0, selectors.EVENT_READ)
        while True:
            left_s = None if deadline_s is None else deadline_s - time.monotonic()
            if left_s is not None and left_s <= 0.0:
                return False
            if selector.select(left_s) and not os.read(0, 4096):
                return True


def ends_with_its_parent() -> Callable[[], object]:
    """Return a function that a child calls first, so that it ends when its parent is killed."""
    return partial(ctypes.CDLL(None).prctl, PR_SET_PDEATHSIG, signal.SIGKILL)


if __name__ == "__main__":
    for number in (signal.SIGINT, signal.SIGTERM):
        # Ctrl-C is for the controller, which closes our input; SIG_IGN would be passed on to the page
        signal.signal(number, lambda *_: None)
    sys.exit(main())
