"""What a model file says of an axis beside its mechanics: the effects of hil_sim that it holds, in SI."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from hil_sim.config import ConfigError
from hil_sim.config.load import EFFECT_PARAMS, read_params
from hil_sim.physics.motor import voltage_saturation
from hil_sim.physics.quantities import effect_name
from hil_sim.physics.registry import EFFECTS
from reconcile.errors import ReconcileError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from reconcile.model_file import NominalAxis

NEUTRAL = {effect_name(module): module.NEUTRAL for module in EFFECTS}
MECHANICS = ("viscous_friction", "coulomb_friction")
"""Read with the axis: they are parameters of every model."""


class Held(NamedTuple):
    """The effects of one axis."""

    effects: dict[str, Any]
    """hil_sim's `Params` by effect; those that change nothing are left out."""
    other: str
    """The axis that cross_axis_coupling follows; empty without it."""


NOTHING_HELD = Held({}, "")


def held_effects(file: Path, name: str, tables: Mapping[str, Any]) -> Held:
    """Read the effects of an axis from the `axis` tables of a model file.

    Raises:
        ReconcileError: a section that the plant would not take; it names the key.

    """
    table, numbers = tables[name], {other: number for number, other in enumerate(tables)}
    own = numbers.pop(name)
    effects, key = {}, f"axis.{name}"
    try:
        for effect, params in EFFECT_PARAMS.items():
            if effect in table and effect not in MECHANICS:
                effects[effect] = read_params(file, f"{key}.{effect}", params, table[effect], numbers)
        limit_v = _given(table, "amplifier", "voltage_limit_v")
        if "winding" in effects and "voltage_saturation" not in effects and limit_v is not None:
            limited = {"voltage_limit_v": limit_v, "resistance_ohm": effects["winding"].resistance_v_a}
            effects["voltage_saturation"] = read_params(
                file, f"{key}.amplifier", voltage_saturation.Params, limited
            )
    except ConfigError as error:
        raise ReconcileError(error.file, error.key, error.reason) from None
    followed = int(effects["cross_axis_coupling"].other) if "cross_axis_coupling" in effects else own
    return Held(
        {effect: params for effect, params in effects.items() if params != NEUTRAL[effect]},
        "" if followed == own else list(tables)[followed],
    )


def _given(table: Mapping[str, Any], section: str, key: str) -> Any:
    values = table.get(section, {})
    return values.get(key) if isinstance(values, dict) else None


def held_base(held: Held, axis: NominalAxis) -> dict[str, float]:
    """Mass and friction of the axis as every model's columns mean them: all that moves, all that rubs."""
    effects, mass_kg, coulomb_n = held.effects, axis.mass_kg, axis.coulomb_n
    for carrying in ("payload_mass", "structural_mode"):
        mass_kg += effects[carrying].mass_kg if carrying in effects else 0.0
    if "presliding_hysteresis" in effects:  # its friction is beside the sharp one, not a share of it
        coulomb_n += effects["presliding_hysteresis"].level_n
    return {"mass_kg": mass_kg, "viscous_n_s_m": axis.viscous_n_s_m, "coulomb_n": coulomb_n}
