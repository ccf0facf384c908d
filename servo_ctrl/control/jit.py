"""Numba, wrapped for this side: a kernel is a pure function, the same for one call and for a batch.

Numba's disk cache looks at the file of the cached function alone: after a change in a file that it calls,
the old machine code would go on running. So the cache's folder is named after the content of every kernel
file, and the folders of earlier contents go, but for the few used last.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numba

if TYPE_CHECKING:
    from collections.abc import Callable

F = TypeVar("F", bound="Callable[..., Any]")

_SETTINGS: Any = numba.config
_CONTROL = Path(__file__).parent
_PREFIX = "control-kernels-"  # the folder may be shared with others, by NUMBA_CACHE_DIR


def _cache_folder() -> Path:
    digest = hashlib.sha256()
    for file in sorted(_CONTROL.rglob("*.py")):
        digest.update(file.read_bytes())
    base = Path(_SETTINGS.CACHE_DIR) if _SETTINGS.CACHE_DIR else _CONTROL / "__pycache__"
    return base / f"{_PREFIX}{digest.hexdigest()[:16]}"


def forget_old_caches(present: Path, kept: int) -> None:
    """Mark the folder `present` as used, and remove its elder siblings but the `kept` last used."""
    with contextlib.suppress(OSError):  # read-only, or another process is doing the same
        if present.exists():
            os.utime(present)
        others = [folder for folder in present.parent.glob(f"{_PREFIX}*") if folder != present]
        others.sort(key=lambda folder: folder.stat().st_mtime)
        for folder in others[: max(0, len(others) - kept)]:
            shutil.rmtree(folder, ignore_errors=True)


_CACHE = _cache_folder()
forget_old_caches(_CACHE, kept=3)


def kernel(function: F) -> F:
    """Compile `function`, cached on disk, with numpy's arithmetic (x / 0 is inf).

    To the type checker the kernel stays the function it was. There is no fast-math: the daemon and
    the batch twin must give the same bits.
    """
    before = _SETTINGS.CACHE_DIR
    _SETTINGS.CACHE_DIR = str(_CACHE)
    try:
        return cast("F", numba.njit(cache=True, error_model="numpy")(function))
    finally:
        _SETTINGS.CACHE_DIR = before


def signatures(function: Callable[..., Any]) -> int:
    """How many combinations of argument types a kernel has been compiled for; more than one is a slip."""
    return len(cast("Any", function).signatures)
