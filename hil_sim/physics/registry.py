"""Discovers every effect: a module in the packages of this room with a `Params` class."""

import pkgutil
from importlib import import_module
from types import ModuleType

from hil_sim.physics import friction, load, motor, sensor, transmission
from hil_sim.physics.kinds import Kind
from kernels.quantities import section_of


def _discovered() -> list[ModuleType]:
    modules = []
    for package in (motor, friction, transmission, load, sensor):
        names = sorted(info.name for info in pkgutil.iter_modules(package.__path__))
        modules += [import_module(f"{package.__name__}.{name}") for name in names]
    return [module for module in modules if hasattr(module, "Params")]


EFFECTS = _discovered()
"""All effects, from motor to sensor, by name within a package."""


def of_kind(*kinds: Kind, common: bool | None = None) -> tuple[ModuleType, ...]:
    """Return the effects of these kinds in the plant's order: by kind, then `ORDER`, then name.

    `common`: True = only effects of nearly every axis, False = only the others, None = all.
    """
    found = [
        module
        for module in EFFECTS
        if module.KIND in kinds and common in {None, getattr(module, "COMMON", False)}
    ]
    found.sort(key=lambda m: (kinds.index(m.KIND), getattr(m, "ORDER", 0), section_of(m)))
    return tuple(found)


def with_state(modules: tuple[ModuleType, ...]) -> tuple[ModuleType, ...]:
    """Return the modules whose effects have memory."""
    return tuple(module for module in modules if hasattr(module, "State"))
