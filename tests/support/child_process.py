"""The end of a process that a test has started."""

import subprocess
from typing import Any


def terminate(process: subprocess.Popen[Any], patience_s: float) -> None:
    """Ask it to end; what does not is killed."""
    process.terminate()
    try:
        process.wait(timeout=patience_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
