"""One step of the effects with a temperature: temperature_dependent_friction and thermal_expansion."""

from types import ModuleType
from typing import Any

from hil_sim.plant.layout import state_record


def temperature_after(effect: ModuleType, p: Any, kelvin: float, friction_w: float, dt_s: float) -> float:
    """The effect's temperature rise (K), from `kelvin` on, after `dt_s` (s) under a friction power (W)."""
    state = state_record(effect)
    [name] = effect.State._fields
    state[name] = kelvin
    effect.advance(p, state, friction_w, 0.0, dt_s)
    return float(state[name])
