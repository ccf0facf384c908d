"""Compiles the simulated axis, with numba's cache in a folder named after the contents of all its files.

Numba checks only the file of a cached function: after a change in a file that it calls, the old machine code
would still run. The generator imports nothing of what it tests, so it has its own decorator.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])

FOLDER = Path(__file__).parent
FILES = sorted([*FOLDER.glob("axis/*.py"), FOLDER / "nonlinearities.py", FOLDER / "simulate.py"])
CONTENTS = hashlib.sha256(b"".join(file.read_bytes() for file in FILES))
CACHE = FOLDER / "__pycache__" / CONTENTS.hexdigest()[:16]
_SETTINGS: Any = numba.config


def compiled(function: F) -> F:
    """Compile a function of the simulation; for the type checker it stays what it was."""
    before = _SETTINGS.CACHE_DIR
    _SETTINGS.CACHE_DIR = str(CACHE)
    try:
        return cast("F", numba.njit(cache=True)(function))
    finally:
        _SETTINGS.CACHE_DIR = before
