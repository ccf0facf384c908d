"""What lies between motor and table, once more and by the whole plant: spring, damper, play, their forces.

The columns of the two senses tell a play and a stiffness. They do not tell how a spring rings nor how a flank
is hit; that is told by the plant itself along the recordings (`contact_fit`). What was found so is written,
with the mass and the friction that it was found beside, and what is left of the force is what this plant
leaves of it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hil_sim.config import build_plant
from hil_sim.physics.quantities import fields_of
from hil_sim.physics.transmission import drive_compliance
from reconcile.catalogue.kinds import Sense
from reconcile.catalogue.registry import meaning_of, systematic
from reconcile.contact_fit import COULOMB, DAMPING, PLAY, STIFFNESS, Seen, Unknown, fitted
from reconcile.contact_follower import Driven, followed
from reconcile.evidence import paired
from reconcile.findings import Estimate
from reconcile.sensing_channel import quantum
from reconcile.state_filter import StateFilter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hil_sim.config import PlantConfig
    from reconcile.contact_fit import ContactFit
    from reconcile.explain import Explanation
    from reconcile.findings import Finding
    from reconcile.rests import Rest

    Array = NDArray[np.float64]

LONGEST_S = 16.0
"""Of all the recordings together: so much tells it."""
BEGIN_S, END_S = 0.2, 0.02
"""Where the observer has not settled, nor the table come to its flank; and what the next motion begins in."""
SURE = 4.0
"""Standard errors by which blocks must fall below those of the values that would be written without it."""
TABLE, MOTOR = ("mechanics", "table_mass_kg"), ("mechanics", "motor_mass_kg")
VISCOUS = ("viscous_friction", "viscous_n_s_m")
MOST = {
    ("drive_compliance", field.name): field.quantity.upper for field in fields_of(drive_compliance.Params)
}
"""What a plant takes."""
OF_SENSORS = ("cross_axis_coupling", "scale_cyclic_error", "encoder_eccentricity")
"""Effects that the drive train knows nothing of: with them the scale does not tell the table."""
CRUMB = 0.25
"""Share of the squares: with less left, what was unknown in the force is what this contact does."""
FILTER_HZ, CLEAN_HZ = 60.0, 150.0
"""Of the senses; and the least corner of a motion that needs no further low pass."""
RINGING = (0.9, 1.0)
"""Factors of the damping's interval: of six concealed springs of 70 to 330 N/um, whose ringing a recording at
1 kHz hardly shows or does not, it was found 1 to 9 % too high."""


class Contact(NamedTuple):
    """What was found, and the plant that has it."""

    fit: ContactFit
    plant: PlantConfig
    axis: int
    """Which of its axes."""


def contact(
    plant: PlantConfig, name: str, deviation: Explanation, *, play: bool, free_spring: bool, own_rotor: bool
) -> Contact | None:
    """By the whole plant; None where the recordings tell no more than what would be written without it.

    `play`: it was found, and is fitted too; `free_spring`: no stiffness was; `own_rotor`: the model tells the
    rotor's mass.
    """
    axis = plant.axes[name]
    if not {*OF_SENSORS}.isdisjoint(axis.effects):
        return None
    seen = _seen(deviation.rests)
    unknowns = _unknowns(plant, name, play=play, free_spring=free_spring, own_rotor=own_rotor)
    if not any(one.judged.any() for one in seen):
        return None
    number = list(plant.axes).index(name)
    fit = fitted(plant, number, unknowns, seen)
    if fit.at_bound or paired(fit.blocks, fit.at_start) < SURE:
        return None
    return Contact(fit, plant, number)


def _seen(rests: Sequence[Rest]) -> list[Seen]:
    """The beginning of the recordings, as much as tells it; held-out blocks drive, and are not fitted."""
    found, left_s = [], LONGEST_S
    for rest in rests:
        scene, period_s = rest.scene, rest.scene.period_s
        count = min(len(scene.time_s), math.floor(left_s / period_s))
        left_s -= count * period_s
        if scene.scale_m is None or count * period_s < 2.0 * BEGIN_S:
            continue
        judged = ~rest.held_out[:count]
        judged[: math.ceil(BEGIN_S / period_s)] = False
        judged[-math.ceil(END_S / period_s) :] = False
        driven = Driven(period_s, scene.force_n[:count], scene.motion.position_m[:count])
        steps_m = _step(driven.motor_m), _step(scene.scale_m[:count])
        found.append(Seen(driven, scene.scale_m[:count], judged, steps_m))
    return found


def _step(values: Array) -> float:
    """Of the sensor; where it has none, as if its noise were one."""
    third = np.diff(values, 3)
    noise = 1.4826 * float(np.median(np.abs(third))) / math.sqrt(20.0)
    return max(quantum(values), noise * math.sqrt(12.0), 1e-12)


def _unknowns(
    plant: PlantConfig, name: str, *, play: bool, free_spring: bool, own_rotor: bool
) -> list[Unknown]:
    """What is fitted, and within which bounds."""
    axis, dt_s = plant.axes[name], plant.dt_s
    table_kg, motor_kg = axis.table.mass_kg, axis.motor_mass_kg
    reduced_kg = table_kg * motor_kg / (table_kg + motor_kg)
    spring = axis.effects["drive_compliance"]
    k, c = spring.stiffness_n_m, spring.damping_n_s_m
    # k dt^2 + 2 c dt stays below the reduced mass, so the substeps hold
    softest, stiffest = (0.05, 50.0) if free_spring else (0.5, 2.0)
    found = [
        Unknown(
            STIFFNESS,
            k,
            softest * k,
            min(stiffest * k, MOST[STIFFNESS], 0.25 * reduced_kg / dt_s**2),
            0.4 if free_spring else 0.02,
            0.003,
            (0.15, 0.4, 1.0, 2.5) if free_spring else (1.0,),
        ),
        Unknown(
            DAMPING,
            c,
            c / 60.0,
            min(60.0 * c, MOST[DAMPING], 0.37 * reduced_kg / dt_s),
            0.3,
            0.003,
            (0.3, 1.0, 3.0),
        ),
        Unknown(TABLE, table_kg, 0.7 * table_kg, 1.4 * table_kg, 0.005, 0.0003),
    ]
    if play:
        b = axis.effects["backlash"].play_m
        found.append(Unknown(PLAY, b, 0.3 * b, 3.0 * b, 0.01, 0.0003))
    if not own_rotor:
        found.append(Unknown(MOTOR, motor_kg, 0.1 * motor_kg, 3.0 * motor_kg, 0.2, 0.003))
    for key, step, fine in ((COULOMB, 0.005, 0.0003), (VISCOUS, 0.02, 0.001)):
        value = float(getattr(axis.effects.get(key[0]), key[1], 0.0))
        if value > 0.0:
            found.append(Unknown(key, value, 0.3 * value, 3.0 * value, step, fine))
    return found


def written(found: Contact, lead_m: float) -> dict[str, dict[str, Any]]:
    """Sections of a plant file."""
    keys = {
        PLAY: ("backlash", "play_um", 1e6),
        STIFFNESS: ("drive_compliance", "stiffness_n_um", 1e-6),
        DAMPING: ("drive_compliance", "damping_n_s_m", 1.0),
        TABLE: ("table", "mass_kg", 1.0),
        MOTOR: ("motor", "inertia_kg_cm2", (lead_m / (2.0 * math.pi)) ** 2 * 1e4),
        COULOMB: ("coulomb_friction", "coulomb_n", 1.0),
        VISCOUS: ("viscous_friction", "viscous_n_s_m", 1.0),
    }
    sections: dict[str, dict[str, Any]] = {}
    for name, value in found.fit.values.items():
        section, key, factor = keys[name]
        sections.setdefault(section, {})[key] = value * factor
    return sections


def note(found: Contact) -> str:
    """What can be checked, with its intervals."""
    fit = found.fit
    said = []
    for name, words, factor, unit in (
        (PLAY, "play", 1e6, "um"),
        (STIFFNESS, "stiffness", 1e-6, "N/um"),
        (DAMPING, "damping", 1.0, "N s/m"),
    ):
        if name in fit.values:
            low, high = (factor * bound for bound in _interval(fit, name))
            said.append(f"{words} {factor * fit.values[name]:.4g} {unit} ({low:.4g} to {high:.4g})")
    share = 1.0 - math.exp(-float(np.log(fit.at_start / fit.blocks).mean()) / 2.0)
    return (
        f"{', '.join(said)}, by the whole plant along the recordings: {100.0 * share:.0f} % of the typical "
        "square of a short block beyond the sensors' steps is gone"
    )


def _interval(fit: ContactFit, name: tuple[str, str]) -> tuple[float, float]:
    low, high = fit.bounds[name]
    return (low * RINGING[0], high * RINGING[1]) if name == DAMPING else (low, high)


def explained(found: Contact, explanations: Sequence[Explanation]) -> list[Explanation]:
    """The force as this plant leaves it, where that is less; what it explains is unknown no longer.

    The deviation stays as the columns leave it: that is what a second diagnosis begins with.
    """
    left = [_left_by(found, one) if one.sense is Sense.FORCE else one for one in explanations]
    return [_with_parameters(one, found.fit) for one in left]


def _left_by(found: Contact, force: Explanation) -> Explanation:
    if any(rest.scene.motion.corner_hz < CLEAN_HZ for rest in force.rests):
        return force
    rests = [rest._replace(after=_left_n(found, rest)) for rest in force.rests]
    train, heldout = (
        math.sqrt(
            float(np.mean(np.concatenate([r.after[r.used & (r.held_out == side)] for r in rests]) ** 2))
        )
        for side in (False, True)
    )
    if not train < force.after.train:
        return force
    told = force.findings
    if train**2 < CRUMB * force.refitted.train**2:
        told = [finding for finding in told if finding.effect != "unknown"]
    return force._replace(
        after=force.after._replace(train=train, heldout=heldout), rests=rests, findings=told
    )


def _left_n(found: Contact, rest: Rest) -> Array:
    """What the plant leaves of one recording's force (n,), behind the filter of the senses."""
    scene, motor_m = rest.scene, rest.scene.motion.position_m
    plant = build_plant(found.plant)
    driven = Driven(scene.period_s, scene.force_n, motor_m)
    run = followed(plant, found.axis, found.fit.values, driven, found.fit.late, found.plant.dt_s)
    low_pass = StateFilter(scene.period_s, FILTER_HZ)
    motor_kg = float(plant.params[found.axis]["mechanics"]["motor_mass_kg"])
    between_m = np.append(motor_m[:1], 0.5 * (motor_m[1:] + motor_m[:-1]))  # as the means of the force are
    left_n: Array = low_pass(run.net_n) - motor_kg * low_pass(between_m, 2)
    return left_n


def _with_parameters(one: Explanation, fit: ContactFit) -> Explanation:
    """The play without what friction presses into its flanks, and the damping, among the parameters."""

    def better(finding: Finding) -> Finding:
        parameters = dict(finding.parameters)
        if finding.effect == "backlash" and PLAY in fit.values:
            play_m, (low_m, high_m) = fit.values[PLAY], _interval(fit, PLAY)
            under, over = systematic("backlash", "play_m", Sense.DEVIATION)
            parameters["play_m"] = Estimate(play_m, low_m - under * play_m, high_m + over * play_m, "m")
        elif finding.effect == "drive_compliance":
            parameters["damping_n_s_m"] = Estimate(fit.values[DAMPING], *_interval(fit, DAMPING), "N s/m")
        else:
            return finding
        values = {key: estimate.value for key, estimate in parameters.items()}
        return finding._replace(
            parameters=parameters, explanation=meaning_of(finding.effect).sentence(values)
        )

    return one._replace(findings=[better(f) for f in one.findings], minor=[better(f) for f in one.minor])
