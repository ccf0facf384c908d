"""Every effect, found in the packages: a module of a kind's package with a `Params` class."""

import pkgutil
from importlib import import_module
from types import ModuleType

from hil_sim.physics import friction, load, motor, sensor, transmission
from hil_sim.physics.kinds import Kind
from kernels.quantities import section_of


def _found() -> list[ModuleType]:
    modules = []
    for package in (motor, friction, transmission, load, sensor):
        names = sorted(info.name for info in pkgutil.iter_modules(package.__path__))
        modules += [import_module(f"{package.__name__}.{name}") for name in names]
    return [module for module in modules if hasattr(module, "Params")]


EFFECTS = _found()
"""The effects, motor to sensor, by name within a kind."""


def of_kind(*kinds: Kind, common: bool | None = None) -> tuple[ModuleType, ...]:
    """The effects of these kinds as the plant applies them: by kind, then `ORDER`, then name.

    `common`: only those that nearly every axis has, or only the others.
    """
    found = [
        module
        for module in EFFECTS
        if module.KIND in kinds and common in {None, getattr(module, "COMMON", False)}
    ]
    found.sort(key=lambda m: (kinds.index(m.KIND), getattr(m, "ORDER", 0), section_of(m)))
    return tuple(found)


def with_state(modules: tuple[ModuleType, ...]) -> tuple[ModuleType, ...]:
    """Those of the modules that have memory."""
    return tuple(module for module in modules if hasattr(module, "State"))
