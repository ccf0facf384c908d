"""Public CANopen programs on vcan0, each test twice in a row; what is not installed is skipped by name."""

import shutil
import subprocess
from pathlib import Path

import pytest

EDS = Path(__file__).resolve().parents[2] / "eds"
BUS, INTERFACE = "socketcan:vcan0", "vcan0"
DRIVE = 1
TWICE = pytest.mark.parametrize("turn", ["first", "second"])
LIMIT_S = 600.0


def installed(*names: str) -> pytest.MarkDecorator:
    """Skip where a program is missing."""
    missing = [name for name in names if shutil.which(name) is None]
    return pytest.mark.skipif(bool(missing), reason=f"{', '.join(missing)} not installed")


def run(*command: str, **options: object) -> subprocess.CompletedProcess[str]:
    """A command to its end, its output as text."""
    return subprocess.run(  # type: ignore[call-overload,no-any-return]  # options of ours only
        command, capture_output=True, text=True, timeout=LIMIT_S, check=False, **options
    )
