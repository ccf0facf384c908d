"""Keeps the page's process alive: `python -m servo_ctrl.daemon.page.page_process_keeper COMMAND...`.

A process of its own, for a fork takes the controller longer than a tick. It ends, and the page with it, when
its standard input does: when the controller says so, and when the controller dies. What the page prints goes
on to standard output; the page's ends are told there too.
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
"""A page that lived so long was a good one; it comes again soon."""
RESTARTS_AT_MOST = 8
"""In a row, without a good one among them."""
STOP_LIMIT_S = 3.0
ENDED = "the page has ended"
"""How the line begins that tells it."""


def main() -> int:
    """Run the command of our arguments again and again, until standard input ends."""
    command = sys.argv[1:]
    pause_s, in_a_row = FIRST_PAUSE_S, 0
    while True:
        began_s = time.monotonic()
        status = _page(command)
        if status is None:
            return 0
        in_a_row = 1 if time.monotonic() - began_s > STEADY_S else in_a_row + 1
        pause_s = FIRST_PAUSE_S if in_a_row == 1 else min(2.0 * pause_s, LONGEST_PAUSE_S)
        again = in_a_row <= RESTARTS_AT_MOST
        what = f"again in {pause_s:g} s" if again else f"{in_a_row} times in a row: it is left alone"
        _say(f"{ENDED} (status {status}), {what}")
        if _input_ends(pause_s if again else None):
            return 0


def _page(command: list[str]) -> int | None:
    """One life of the page: its exit status, or None when it was ended because standard input has."""
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
    """Wait so long, or for ever, for the end of standard input."""
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
    """What a child does before it begins, so that it ends when its parent is killed."""
    return partial(ctypes.CDLL(None).prctl, PR_SET_PDEATHSIG, signal.SIGKILL)


def _say(text: str) -> None:
    print(text, flush=True)  # noqa: T201  # the controller reads it


if __name__ == "__main__":
    for number in (signal.SIGINT, signal.SIGTERM):
        # Ctrl-C is the controller's, which tells us when it is done; ignored, it would be so in the page too
        signal.signal(number, lambda *_: None)
    sys.exit(main())
