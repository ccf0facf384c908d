"""Every effect there is, found by looking: a module of a kind's package with a `Params` class."""

from __future__ import annotations

import pkgutil
from importlib import import_module
from typing import TYPE_CHECKING

from hil_sim.physics import friction, load, motor, sensor, transmission

if TYPE_CHECKING:
    from types import ModuleType


def _found() -> list[ModuleType]:
    modules = []
    for package in (motor, friction, transmission, load, sensor):
        names = sorted(info.name for info in pkgutil.iter_modules(package.__path__))
        modules += [import_module(f"{package.__name__}.{name}") for name in names]
    return [module for module in modules if hasattr(module, "Params")]


EFFECTS = _found()
"""The effects, motor to sensor, by name within a kind."""
