"""Numba, wrapped for this side: a kernel is a pure function, the same for one call and for a batch.

Numba's disk cache looks at the file of the cached function alone: after a change in a file that it calls,
the old machine code would go on running. So the cache's folder is named after the content of every kernel
file.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numba

if TYPE_CHECKING:
    from collections.abc import Callable

F = TypeVar("F", bound="Callable[..., Any]")

_CONFIG: Any = numba.config
_PHYSICS = Path(__file__).parent
_PLANT = _PHYSICS.parent / "plant"


def _cache_folder() -> str:
    digest = hashlib.sha256()
    for file in sorted([*_PHYSICS.rglob("*.py"), *_PLANT.rglob("*.py")]):
        digest.update(file.read_bytes())
    base = Path(_CONFIG.CACHE_DIR) if _CONFIG.CACHE_DIR else _PHYSICS / "__pycache__"
    return str(base / f"kernels-{digest.hexdigest()[:16]}")


_CACHE = _cache_folder()


def kernel(function: F) -> F:
    """Compile `function`, cached on disk, with numpy's arithmetic (x / 0 is inf).

    To the type checker the kernel stays the function it was. There is no fast-math: the simulator and
    the batch twin must give the same bits.
    """
    before = _CONFIG.CACHE_DIR
    _CONFIG.CACHE_DIR = _CACHE
    try:
        return cast("F", numba.njit(cache=True, error_model="numpy")(function))
    finally:
        _CONFIG.CACHE_DIR = before
