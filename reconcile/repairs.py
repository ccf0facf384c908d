"""What was found, as the sections of a plant file: each effect by the parameters that hil_sim knows it by."""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

from hil_sim.physics.quantities import effect_name, fields_of
from hil_sim.physics.registry import EFFECTS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from reconcile.explain import Explanation
    from reconcile.findings import Finding
    from reconcile.model_file import NominalAxis

MODULES = {effect_name(module): module for module in EFFECTS}
CONTACT_N_M, CONTACT_N_S_M = 2e8, 5e3
"""A play needs a contact; where no compliance was seen, it is stiffer than could be seen."""
MOTOR_SHARE = 0.3
"""Of the moved mass, before the spring, where the model does not tell the rotor's inertia."""
HARMONIC = ("cogging", "torque_ripple")
RENAMED = {
    "lead_error_periodic": {"amplitude": "amplitude_m"},
    "scale_cyclic_error": {"amplitude": "amplitude_m"},
    "periodic_disturbance": {"amplitude": "amplitude_n"},
    "transport_delay": {"time_s": "delay_s"},
}
"""Parameters that have another name in the plant."""
NOT_YET = (
    "torque_constant_saturation",
    "cross_axis_coupling",
    "temperature_dependent_friction",
    "thermal_expansion",
    "position_dependent_friction",
    "position_dependent_force",
)
"""Found and reported, but not written into the model yet."""


def sections(explanations: Sequence[Explanation], axis: NominalAxis) -> dict[str, dict[str, Any]]:
    """Sections and keys of the axis' table in a plant file, in the file's units."""
    found: dict[str, dict[str, Any]] = {}
    for explanation in explanations:
        if explanation.sense.value == "force" and (explanation.findings or explanation.parameters_matter):
            base = explanation.base
            found["table"] = {"mass_kg": max(base["mass_kg"] - axis.motor_mass_kg, 1e-3)}
            found["viscous_friction"] = {"viscous_n_s_m": max(base["viscous_n_s_m"], 0.0)}
            found["coulomb_friction"] = {"coulomb_n": max(_sharp_n(explanation), 0.0)}
        for finding in explanation.findings:
            values = _values(finding, axis)
            if values is not None:
                found[finding.effect] = in_file_units(finding.effect, values)
    if "backlash" in found and "drive_compliance" not in found:
        values = {"stiffness_n_m": CONTACT_N_M, "damping_n_s_m": CONTACT_N_S_M}
        found["drive_compliance"] = in_file_units("drive_compliance", values)
    if "drive_compliance" in found and axis.motor_mass_kg == 0.0:
        mass_kg = found.get("table", {}).get("mass_kg", axis.mass_kg)
        inertia_kg_m2 = MOTOR_SHARE * mass_kg * (axis.lead_m / (2.0 * math.pi)) ** 2
        found["motor"] = {"inertia_kg_cm2": inertia_kg_m2 * 1e4}
        found["table"] = {"mass_kg": (1.0 - MOTOR_SHARE) * mass_kg}
    return found


def in_file_units(effect: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """SI values by parameter as the keys and units of a plant file."""
    table: dict[str, Any] = {}
    for field in fields_of(MODULES[effect].Params):
        if field.name not in values:
            continue
        value = values[field.name]
        quantity = field.quantity
        if isinstance(value, list | tuple):
            table[field.key] = [float(quantity.from_si(v)) for v in value]
        else:
            within = min(max(float(value), quantity.lower), quantity.upper)
            table[field.key] = float(quantity.from_si(within))
    return table


def _sharp_n(explanation: Explanation) -> float:
    """Coulomb friction that is there at once: what builds up over a way is not."""
    slow = [f for f in explanation.findings if f.effect == "presliding_hysteresis"]
    late_n = sum(e.value for f in slow for key, e in f.parameters.items() if key.startswith("level_n"))
    return explanation.base["coulomb_n"] - late_n


def _values(finding: Finding, axis: NominalAxis) -> dict[str, Any] | None:
    """Parameters in SI by their names in hil_sim; None where the effect has no plant file entry yet."""
    p = {key: estimate.value for key, estimate in finding.parameters.items()}
    effect = finding.effect
    if effect in NOT_YET:
        return None
    if effect in HARMONIC:
        return _harmonics(p, finding)
    if effect == "presliding_hysteresis":
        return _presliding(p)
    if effect == "drive_compliance":
        # the damping was not seen: 3 % of the critical one of what moves behind the spring
        p["damping_n_s_m"] = 2.0 * 0.03 * math.sqrt(p["stiffness_n_m"] * axis.mass_kg)
    elif effect == "amplifier_dead_zone":
        p["threshold_a"] = abs(p["threshold_n"]) / axis.force_constant_n_a
    known = {field.name for field in fields_of(MODULES[effect].Params)}
    names = RENAMED.get(effect, {})
    return {names.get(key, key): value for key, value in p.items() if names.get(key, key) in known}


def _presliding(p: Mapping[str, float]) -> dict[str, Any]:
    """One level that builds up over the mean of the ways, by their logarithm."""
    levels_n = [value for key, value in p.items() if key.startswith("level_n")]
    ways_m = [value for key, value in p.items() if key.startswith("way_m")]
    total_n = sum(levels_n)
    mean = sum(math.log(way) * level for way, level in zip(ways_m, levels_n, strict=True)) / total_n
    return {"level_n": total_n, "way_m": math.exp(mean)}


def _harmonics(p: Mapping[str, float], finding: Finding) -> dict[str, Any]:
    """Up to six harmonics as lists."""
    ends = [f"_{i + 1}" for i in range(len(finding.candidates))] if len(finding.candidates) > 1 else [""]
    terms = import_module(MODULES[finding.effect].__name__).TERMS
    columns = [[p[f"{key}{end}"] for end in ends[:terms]] for key in ("harmonic", "amplitude", "phase_rad")]
    amplitude = "amplitude_n" if finding.effect == "cogging" else "amplitude"
    return {"harmonic": columns[0], amplitude: columns[1], "phase_rad": columns[2]}
