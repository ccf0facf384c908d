"""Every entry of the catalogue, found by looking: a module with `HYPOTHESES`."""

from __future__ import annotations

import pkgutil
from importlib import import_module
from typing import TYPE_CHECKING, cast

from reconcile import catalogue
from reconcile.catalogue.kinds import Sense
from reconcile.smooth_terms import PREFIX
from reconcile.strange_terms import Unknown

if TYPE_CHECKING:
    from types import ModuleType

    import numpy as np
    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Hypothesis, Meaning

    Array = NDArray[np.float64]


def _found() -> dict[str, ModuleType]:
    names = sorted(info.name for info in pkgutil.iter_modules(catalogue.__path__))
    modules = {name: import_module(f"{catalogue.__name__}.{name}") for name in names if name != "registry"}
    return {name: module for name, module in modules.items() if hasattr(module, "HYPOTHESES")}


ENTRIES = _found()
"""By the effect's name."""


def hypotheses(effect: str, sense: Sense) -> list[Hypothesis]:
    """How an effect would show in a sense: one with shared coefficients, one with own ones, or neither."""
    return [h for h in ENTRIES[effect].HYPOTHESES if h.sense is sense]


def possible(effect: str, coefficients: Array) -> bool:
    """Whether nature has such coefficients."""
    rule = getattr(ENTRIES.get(effect), "possible", None)
    return True if rule is None else bool(rule(coefficients))


FORM = {Sense.FORCE: 0.08, Sense.DEVIATION: 0.01}
"""Share of a coefficient's value by which laws of another form mislead it: see docs/blind-trials.md."""


def systematic(effect: str, parameter: str, sense: Sense) -> tuple[float, float]:
    """How far below and above a parameter's value the truth may lie beside the scatter, as shares of it."""
    own = getattr(ENTRIES.get(effect), "SYSTEMATIC", {})
    low, high = own.get(parameter, (FORM[sense], FORM[sense]))
    return float(low), float(high)


def meaning_of(effect: str) -> Meaning:
    """What the coefficients of an effect, or of a smooth term, say."""
    if effect.startswith(PREFIX):
        return Unknown(effect)
    return cast("Meaning", ENTRIES[effect])
