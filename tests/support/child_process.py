"""Ends a process that a test has started."""

import subprocess
from typing import Any

from forked_program import ForkedProgram


def terminate(process: subprocess.Popen[Any] | ForkedProgram, timeout_s: float) -> None:
    """Terminate the process; kill it after `timeout_s`."""
    process.terminate()
    try:
        process.wait(timeout=timeout_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
