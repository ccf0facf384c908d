"""A program that a notebook starts inherits the notebook's name for how pictures are shown."""

from collections.abc import MutableMapping
from importlib.util import find_spec

_NAME, _MODULE = "MPLBACKEND", "module://"


def forget_missing_backend(variables: MutableMapping[str, str]) -> None:
    """Remove a backend whose package is not installed here: matplotlib would refuse to be imported."""
    backend = variables.get(_NAME, "")
    package = backend.removeprefix(_MODULE).partition(".")[0]
    if backend.startswith(_MODULE) and find_spec(package) is None:
        del variables[_NAME]
