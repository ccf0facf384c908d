"""Imports a library without an optional package that it would also load."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def as_if_absent(package: str) -> Iterator[None]:
    """Within the block, import as if `package` were not installed, unless it is loaded already.

    A None in `sys.modules` makes an import fail with ModuleNotFoundError (Python reference, 5.3.1 The module
    cache), which a library expects from an optional package.
    """
    if package in sys.modules:
        yield
        return
    sys.modules[package] = None  # type: ignore[assignment]  # typeshed omits the documented None
    try:
        yield
    finally:
        del sys.modules[package]
