"""Find the physics that a simulation left out: recordings and a model in, a verdict and a repaired model out.

Each room may import the rooms below it: api, cli; examples, trials, fleet, watch, loop; diagnosis; report;
design; model_update; replay; location; identification; selection; regression; nominal_model; sensing;
recording; catalogue; formats.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from reconcile.api.diagnose import diagnose
    from reconcile.api.result import Diagnosis, Finding, Parameter
    from reconcile.errors import ReconcileError

__all__ = ["Diagnosis", "Finding", "Parameter", "ReconcileError", "diagnose"]

_HOMES = {
    "Diagnosis": "reconcile.api.result",
    "Finding": "reconcile.api.result",
    "Parameter": "reconcile.api.result",
    "ReconcileError": "reconcile.errors",
    "diagnose": "reconcile.api.diagnose",
}
"""Module of each public name, loaded at first use, so that importing the package stays light."""


def __getattr__(name: str) -> Any:
    """Load a public name."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)
