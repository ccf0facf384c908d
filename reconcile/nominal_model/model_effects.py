"""Reads the effects of hil_sim in a model file, beside the mechanics of an axis, in SI."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil_sim.config import ConfigError
from hil_sim.config.load import EFFECT_PARAMS, read_params
from hil_sim.physics.motor import voltage_saturation
from hil_sim.physics.registry import EFFECTS
from kernels.quantities import section_of
from reconcile.errors import ReconcileError
from reconcile.formats.nominal_axis import ModelEffects

NEUTRAL = {section_of(module): module.NEUTRAL for module in EFFECTS}
MECHANICS = ("viscous_friction", "coulomb_friction")
"""Effects that are read with the axis, because every model has them."""


def model_effects_of(file: Path, name: str, tables: Mapping[str, Any]) -> ModelEffects:
    """Read the effects of an axis from the `axis` tables of a model file.

    Raises:
        ReconcileError: a section that the plant would refuse; it names the key.

    """
    table, numbers = tables[name], {other: number for number, other in enumerate(tables)}
    del numbers[name]
    effects, key = {}, f"axis.{name}"
    try:
        for effect, params in EFFECT_PARAMS.items():
            if effect in table and effect not in MECHANICS:
                effects[effect] = read_params(file, f"{key}.{effect}", params, table[effect], numbers)
        amplifier = table.get("amplifier", {})
        limit_v = amplifier.get("voltage_limit_v") if isinstance(amplifier, dict) else None
        if "winding" in effects and "voltage_saturation" not in effects and limit_v is not None:
            limited = {"voltage_limit_v": limit_v, "resistance_ohm": effects["winding"].resistance_v_a}
            effects["voltage_saturation"] = read_params(
                file, f"{key}.amplifier", voltage_saturation.Params, limited
            )
    except ConfigError as error:
        raise ReconcileError(error.file, error.key, error.reason) from None
    kept = {effect: params for effect, params in effects.items() if params != NEUTRAL[effect]}
    names = list(tables)
    followed = {effect: names[int(p.other)] for effect, p in kept.items() if "other" in p._fields}
    return ModelEffects(kept, followed)
