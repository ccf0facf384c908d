"""Numba, wrapped for this side: a kernel is a pure function, the same for one call and for a batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar, cast

import numba

if TYPE_CHECKING:
    from collections.abc import Callable

F = TypeVar("F", bound="Callable[..., Any]")


def kernel(function: F) -> F:
    """Compile `function`, cached on disk, with numpy's arithmetic (x / 0 is inf).

    To the type checker the kernel stays the function it was. There is no fast-math: the simulator and
    the batch twin must give the same bits.
    """
    return cast("F", numba.njit(cache=True, error_model="numpy")(function))
