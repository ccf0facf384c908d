"""The simulated machine: drives (CiA 402) and linear scales (CiA 406) on a CAN bus, in front of a plant.

It is connected to the controller only by the bus and imports nothing of it.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hil_sim.bench.bench import Bench, BenchError

__all__ = ["Bench", "BenchError"]

_MODULES = {"Bench": "hil_sim.bench.bench", "BenchError": "hil_sim.bench.bench"}
"""Modules of the public names, which are imported at first use to keep the import of the package fast."""


def __getattr__(name: str) -> Any:
    """Import a public name. Raises AttributeError for any other."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_MODULES[name]), name)
