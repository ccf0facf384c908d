"""Removes the matplotlib backend of a notebook from the environment of a program that it starts."""

from collections.abc import MutableMapping
from importlib.util import find_spec

_VARIABLE, _MODULE_PREFIX = "MPLBACKEND", "module://"


def forget_missing_backend(variables: MutableMapping[str, str]) -> None:
    """Remove a backend whose package is not installed here: matplotlib would refuse to be imported."""
    backend = variables.get(_VARIABLE, "")
    package = backend.removeprefix(_MODULE_PREFIX).partition(".")[0]
    if backend.startswith(_MODULE_PREFIX) and find_spec(package) is None:
        del variables[_VARIABLE]
