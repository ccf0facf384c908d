"""Imports of a library without an optional package that it would load beside itself."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def as_if_absent(package: str) -> Iterator[None]:
    """Import within it as if `package` were not installed; where it is loaded already, nothing changes.

    A None in `sys.modules` makes an import fail with ModuleNotFoundError (Python reference, 5.3.1 The module
    cache), which a library expects of a package that is optional to it.
    """
    if package in sys.modules:
        yield
        return
    sys.modules[package] = None  # type: ignore[assignment]  # typeshed leaves the documented None out
    try:
        yield
    finally:
        del sys.modules[package]
