"""One step of the effects with a temperature: temperature_dependent_friction and thermal_expansion."""

from types import ModuleType
from typing import Any

from hil_sim.plant.layout import state_record


def temperature_after(effect: ModuleType, p: Any, kelvin: float, friction_w: float, dt_s: float) -> float:
    """Return the effect's temperature rise (K) after `dt_s` (s) of a friction power (W), from `kelvin` on."""
    state = state_record(effect)
    [name] = effect.State._fields
    state[name] = kelvin
    effect.advance(p, state, friction_w, 0.0, dt_s)
    return float(state[name])
