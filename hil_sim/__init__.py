"""The simulated machine: drives (CiA 402) and linear scales (CiA 406) on a CAN bus, in front of a plant.

It meets the controller on the bus alone and imports nothing of it.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hil_sim.bench.bench import Bench, BenchError

__all__ = ["Bench", "BenchError"]

_HOMES = {
    "Bench": "hil_sim.bench.bench",
    "BenchError": "hil_sim.bench.bench",
}
"""Where the public names live: loaded when first used, for importing the package must stay light."""


def __getattr__(name: str) -> Any:
    """Load a public name."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)
