"""Values that sections of a plant file share: the masses beside a spring, the friction of two laws."""

import math
from collections.abc import Sequence
from typing import Any

from reconcile.catalogue.drive_compliance import CONTACT_DAMPING_RATIO, CONTACT_N_M
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.identification.explain import Explanation

LEAST_MASS_KG = 1e-7
"""Least table mass of a plant, the lower bound of hil_sim."""
DAMPING_RATIO = 0.03
"""Damping ratio of a spring whose damping was not identified; chosen."""
MOTOR_SHARE = 0.3
"""Share of the moved mass on the motor side of a spring where the model has no rotor inertia; chosen."""
LEAST_MOTOR_SHARE = 0.02
"""Least share of the moved mass on the motor side of a spring that the motor alone showed; chosen."""

Sections = dict[str, dict[str, Any]]


def rotor(motor_kg: float, axis: NominalAxis) -> dict[str, Any]:
    """Return the section of a rotor with this equivalent mass at the table."""
    return {"inertia_kg_cm2": motor_kg * (axis.lead_m / (2.0 * math.pi)) ** 2 * 1e4}


def share_friction(sections: Sections, notes: list[str]) -> None:
    """Subtract presliding levels from the Coulomb friction; keep the friction at rest from being negative."""
    if "coulomb_friction" not in sections:
        return
    sharp_n = sections["coulomb_friction"]["coulomb_n"]
    for name in ("presliding_hysteresis", "presliding_elements"):
        if not (presliding := sections.get(name)):
            continue
        if presliding["level_n"] > sharp_n:
            notes.append(
                f"{name}.level_n was found to be {presliding['level_n']:.4g}; it is held to "
                f"the Coulomb friction, {sharp_n:.4g} N"
            )
            presliding["level_n"] = sharp_n
        sharp_n -= presliding["level_n"]
        sections["coulomb_friction"]["coulomb_n"] = sharp_n
    stribeck = sections.get("stribeck_friction")
    if stribeck and stribeck["stribeck_n"] < -sharp_n:
        notes.append(
            f"stribeck_friction.stribeck_n was found to be {stribeck['stribeck_n']:.4g}; it is written as "
            f"{-sharp_n:.4g}, for friction at rest cannot be below 0"
        )
        stribeck["stribeck_n"] = -sharp_n


def share_mass(sections: Sections, axis: NominalAxis) -> None:
    """Subtract a payload from the table, because the fitted mass includes it."""
    if "payload_mass" not in sections:
        return
    whole_kg = sections["table"]["mass_kg"] if "table" in sections else axis.mass_kg - axis.motor_mass_kg
    payload_kg = min(sections["payload_mass"]["mass_kg"], whole_kg - LEAST_MASS_KG)
    sections["payload_mass"]["mass_kg"] = payload_kg
    sections["table"] = {"mass_kg": whole_kg - payload_kg}


def split_at_the_spring(
    explanations: Sequence[Explanation], sections: Sections, axis: NominalAxis, notes: list[str]
) -> None:
    """Divide the mass at a spring that the motor alone identified, by its load mass."""
    named = [f for e in explanations for f in [*e.findings, *e.minor] if f.effect == "drive_compliance"]
    loads = [f.parameters["load_mass_kg"].value for f in named if "load_mass_kg" in f.parameters]
    if not loads or "drive_compliance" not in sections:
        return
    payload_kg = sections.get("payload_mass", {}).get("mass_kg", 0.0)
    table_kg = sections.get("table", {}).get("mass_kg", axis.mass_kg - axis.motor_mass_kg)
    whole_kg = axis.motor_mass_kg + table_kg + payload_kg
    load_kg = min(loads[0], (1.0 - LEAST_MOTOR_SHARE) * whole_kg)
    if load_kg < loads[0]:
        notes.append(
            f"drive_compliance.load_mass_kg was found to be {loads[0]:.4g} of {whole_kg:.4g} in all; "
            f"{load_kg:.4g} is written, for something must move before the spring"
        )
    sections["motor"] = rotor(whole_kg - load_kg, axis)
    sections["table"] = {"mass_kg": max(load_kg - payload_kg, LEAST_MASS_KG)}


def give_the_spring_masses(sections: Sections, axis: NominalAxis, substep_s: float, notes: list[str]) -> None:
    """Complete a spring by a mass on either side, damping, and a stiffness that the substep resolves."""
    if "drive_compliance" not in sections:
        return
    spring = sections["drive_compliance"]
    payload_kg = sections.get("payload_mass", {}).get("mass_kg", 0.0)
    table_kg = sections.get("table", {}).get("mass_kg", axis.mass_kg - axis.motor_mass_kg)
    turn_m = axis.lead_m / (2.0 * math.pi)
    motor_kg = axis.motor_mass_kg
    if "motor" in sections:
        motor_kg = sections["motor"]["inertia_kg_cm2"] * 1e-4 / turn_m**2
    elif motor_kg == 0.0:
        motor_kg = MOTOR_SHARE * (table_kg + payload_kg)
        table_kg = max(table_kg - motor_kg, LEAST_MASS_KG)
        sections["motor"] = {"inertia_kg_cm2": motor_kg * turn_m**2 * 1e4}
        sections["table"] = {"mass_kg": table_kg}
        notes.append(
            f"drive_compliance needs motor.inertia_kg_cm2, which the nominal model does not have: "
            f"{100.0 * MOTOR_SHARE:.0f} % of the moved mass is taken for it"
        )
    reduced_kg = motor_kg * (table_kg + payload_kg) / (motor_kg + table_kg + payload_kg)
    ratio = CONTACT_DAMPING_RATIO if spring["stiffness_n_um"] == CONTACT_N_M * 1e-6 else DAMPING_RATIO
    if "damping_n_s_m" in spring:
        ratio = spring["damping_n_s_m"] / (2.0 * math.sqrt(spring["stiffness_n_um"] * 1e6 * reduced_kg))
    # k dt^2 + 2 c dt is at most the reduced mass, c = 2 ratio sqrt(k m)
    highest_n_m = reduced_kg * (0.99 * (math.hypot(2.0 * ratio, 1.0) - 2.0 * ratio) / substep_s) ** 2
    stiffness_n_m = spring["stiffness_n_um"] * 1e6
    if stiffness_n_m > highest_n_m:
        notes.append(
            f"drive_compliance.stiffness_n_um {stiffness_n_m * 1e-6:.4g} is too stiff for the substep of "
            f"{substep_s * 1e6:g} us; it is {highest_n_m * 1e-6:.4g}"
        )
        stiffness_n_m = highest_n_m
    sections["drive_compliance"] = {
        "stiffness_n_um": stiffness_n_m * 1e-6,
        "damping_n_s_m": 2.0 * ratio * math.sqrt(stiffness_n_m * reduced_kg),
    }
