"""The batch twin as a program of its own: it knows the plant, nothing of servo_ctrl does.

It is started as the simulator is, and leaves files. What it prints is its progress, or why it gave up.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from typing import TYPE_CHECKING

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.experiment.simulated_machine import ends_with_its_parent

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

LINES_KEPT = 3


class TwinError(ServoCtrlError):
    """The batch twin did not come to its end, or left something else than results."""


def run_twin(
    module: str, arguments: Sequence[str], limit_s: float, on_line: Callable[[str], None] = lambda _line: None
) -> None:
    """Run `python -m MODULE ARGUMENTS`; its processes end with us. Raises TwinError."""
    last: list[str] = []
    overdue = threading.Event()
    with subprocess.Popen(
        [sys.executable, "-m", module, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        preexec_fn=ends_with_its_parent(),  # noqa: PLW1509  # one system call, no lock
    ) as process:

        def give_up() -> None:
            overdue.set()
            _kill(process)

        timer = threading.Timer(limit_s, give_up)
        timer.start()
        try:
            for line in process.stdout or ():
                on_line(line.strip())
                last = [*last, line.strip()][-LINES_KEPT:]
            process.wait()
        finally:
            timer.cancel()
            _kill(process)
    if overdue.is_set():
        raise TwinError(f"the batch twin did not end within {limit_s:g} s")
    if process.returncode:
        text = " | ".join(last) or "it printed nothing"
        raise TwinError(f"the batch twin ended with {process.returncode}: {text}")


def _kill(process: subprocess.Popen[str]) -> None:
    """It and what it has started."""
    if process.poll() is None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
