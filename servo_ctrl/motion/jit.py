"""Numba, wrapped for motion: what goes from piece to piece of a path, one after the other, is compiled.

Numba's disk cache looks at the file of the cached function alone, so a kernel here calls kernels of its
own file only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar, cast

import numba

if TYPE_CHECKING:
    from collections.abc import Callable

F = TypeVar("F", bound="Callable[..., Any]")


def kernel(function: F) -> F:
    """Compile `function`, cached on disk, with numpy's arithmetic (x / 0 is inf)."""
    return cast("F", numba.njit(cache=True, error_model="numpy")(function))
