"""Two-mass identification: spring, damper and backlash between motor and table, by the whole plant.

The columns of the two channels give a backlash gap and a stiffness, but neither the damping of the spring nor
the impact on a flank. These come from an output-error fit of the plant along the recordings (`two_mass_fit`).
Its values, with the mass and friction fitted beside them, go into the plant file, and the force residual
becomes that of this plant.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import PlantConfig, build_plant
from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import of_kind
from hil_sim.physics.transmission import drive_compliance
from kernels.arrays import Array
from kernels.quantities import fields_of, section_of
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.registry import systematic
from reconcile.catalogue.unnamed_terms import meaning_of
from reconcile.identification.explain import Explanation
from reconcile.identification.findings import IdentifiedEffect
from reconcile.identification.parameter_estimates import Estimate
from reconcile.identification.two_mass_fit import (
    COULOMB,
    DAMPING,
    PLAY,
    STIFFNESS,
    FreeParameter,
    TwoMassFit,
    fit_two_mass,
)
from reconcile.identification.two_mass_recording import two_mass_recordings
from reconcile.identification.two_mass_rollout import DrivingInputs, respond
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.regression_data import LEAST_CLEAN_HZ
from reconcile.regression.residual import Residual
from reconcile.regression.state_filter import StateFilter
from reconcile.selection.block_statistics import log_ratio_t

LEAST_STANDARD_ERRORS = 4.0
"""Least significance of the improvement over the starting values, in standard errors."""
TABLE, MOTOR = ("mechanics", "table_mass_kg"), ("mechanics", "motor_mass_kg")
VISCOUS = ("viscous_friction", "viscous_n_s_m")
UPPER_BOUNDS = {
    ("drive_compliance", field.name): field.quantity.upper for field in fields_of(drive_compliance.Params)
}
"""Upper bounds of the plant's parameters."""
SENSOR_EFFECTS = frozenset(
    section_of(module) for module in of_kind(Kind.ENCODER_READING, Kind.SCALE_READING, Kind.CROSS_READING)
)
"""Effects of the sensors: with one of them the scale does not measure the table."""
UNEXPLAINED_SHARE = 0.25
"""Share of the refitted squares below which an `unknown` in the force is explained by this model."""
DAMPING_INTERVAL_FACTORS = (0.9, 1.0)
"""Factors on the damping's interval. Calibrated on six concealed springs of 70 to 330 N/um, whose ringing a
recording at 1 kHz hardly shows: the damping was identified 1 to 9 % too high."""


class TwoMassModel(NamedTuple):
    """The fit and the plant that it was made with."""

    fit: TwoMassFit
    plant: PlantConfig
    axis: int
    """Index of the axis in the plant."""


def identify_two_mass(
    plant: PlantConfig, name: str, deviation: Explanation, *, play: bool, free_spring: bool, own_rotor: bool
) -> TwoMassModel | None:
    """Fit the whole plant; None where it does not improve on the starting values significantly.

    `play`: backlash was identified, and is fitted too; `free_spring`: no stiffness was identified, so it is
    searched widely; `own_rotor`: the model has the rotor's mass, which is not fitted.
    """
    axis = plant.axes[name]
    if not SENSOR_EFFECTS.isdisjoint(axis.effects):
        return None
    recordings = two_mass_recordings(deviation.residuals)
    free_parameters = _free_parameters(plant, name, play=play, free_spring=free_spring, own_rotor=own_rotor)
    if not any(one.used.any() for one in recordings):
        return None
    number = list(plant.axes).index(name)
    fit = fit_two_mass(plant, number, free_parameters, recordings)
    if fit.at_bound or log_ratio_t(fit.blocks, fit.at_start) < LEAST_STANDARD_ERRORS:
        return None
    return TwoMassModel(fit, plant, number)


def _free_parameters(
    plant: PlantConfig, name: str, *, play: bool, free_spring: bool, own_rotor: bool
) -> list[FreeParameter]:
    """Parameters to fit with start, bounds and steps."""
    axis, dt_s = plant.axes[name], plant.dt_s
    table_kg, motor_kg = axis.table.mass_kg, axis.motor_mass_kg
    reduced_kg = table_kg * motor_kg / (table_kg + motor_kg)
    spring = axis.effects["drive_compliance"]
    stiffness_n_m, damping_n_s_m = spring.stiffness_n_m, spring.damping_n_s_m
    # stiffness * dt^2 + 2 * damping * dt < reduced mass keeps the substeps stable
    softest, stiffest = (0.05, 50.0) if free_spring else (0.5, 2.0)
    free = [
        FreeParameter(
            name=STIFFNESS,
            start=stiffness_n_m,
            low=softest * stiffness_n_m,
            high=min(stiffest * stiffness_n_m, UPPER_BOUNDS[STIFFNESS], 0.25 * reduced_kg / dt_s**2),
            step=0.4 if free_spring else 0.02,
            fine=0.003,
            grid=(0.15, 0.4, 1.0, 2.5) if free_spring else (1.0,),
        ),
        FreeParameter(
            name=DAMPING,
            start=damping_n_s_m,
            low=damping_n_s_m / 60.0,
            high=min(60.0 * damping_n_s_m, UPPER_BOUNDS[DAMPING], 0.37 * reduced_kg / dt_s),
            step=0.3,
            fine=0.003,
            grid=(0.3, 1.0, 3.0),
        ),
        _around(TABLE, table_kg, 0.7, 1.4, step=0.005, fine=0.0003),
    ]
    if play:
        free.append(_around(PLAY, axis.effects["backlash"].play_m, 0.3, 3.0, step=0.01, fine=0.0003))
    if not own_rotor:
        free.append(_around(MOTOR, motor_kg, 0.1, 3.0, step=0.2, fine=0.003))
    for key, step, fine in ((COULOMB, 0.005, 0.0003), (VISCOUS, 0.02, 0.001)):
        value = float(getattr(axis.effects.get(key[0]), key[1], 0.0))
        if value > 0.0:
            free.append(_around(key, value, least=0.3, most=3.0, step=step, fine=fine))
    return free


def _around(
    name: tuple[str, str], start: float, least: float, most: float, step: float, fine: float
) -> FreeParameter:
    """A parameter between `least` and `most` times its start."""
    return FreeParameter(name=name, start=start, low=least * start, high=most * start, step=step, fine=fine)


def plant_sections(model: TwoMassModel, lead_m: float) -> dict[str, dict[str, Any]]:
    """Sections of a plant file with the fitted values, in the file's units."""
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
    for name, value in model.fit.values.items():
        section, key, factor = keys[name]
        sections.setdefault(section, {})[key] = value * factor
    return sections


def summary_note(model: TwoMassModel) -> str:
    """Sentence with the fitted values and their intervals."""
    fit = model.fit
    parts = []
    for name, words, factor, unit in (
        (PLAY, "play", 1e6, "um"),
        (STIFFNESS, "stiffness", 1e-6, "N/um"),
        (DAMPING, "damping", 1.0, "N s/m"),
    ):
        if name in fit.values:
            low, high = (factor * bound for bound in _interval(fit, name))
            parts.append(f"{words} {factor * fit.values[name]:.4g} {unit} ({low:.4g} to {high:.4g})")
    share = 1.0 - math.exp(-float(np.log(fit.at_start / fit.blocks).mean()) / 2.0)
    return (
        f"{', '.join(parts)}, by the whole plant along the recordings: {100.0 * share:.0f} % of the typical "
        "square of a short block beyond the sensors' steps is gone"
    )


def _interval(fit: TwoMassFit, name: tuple[str, str]) -> tuple[float, float]:
    factors = DAMPING_INTERVAL_FACTORS if name == DAMPING else (1.0, 1.0)
    return fit.bounds[name][0] * factors[0], fit.bounds[name][1] * factors[1]


def with_two_mass_force(model: TwoMassModel, explanations: Sequence[Explanation]) -> list[Explanation]:
    """Replace the force residual by that of this plant, where it is smaller.

    The deviation residual stays that of the columns, because a second diagnosis starts from it.
    """
    by_plant = (_with_force_of(model, one) for one in explanations)
    return [_with_fitted_parameters(one, model.fit) for one in by_plant]


def _with_force_of(model: TwoMassModel, force: Explanation) -> Explanation:
    noisy = any(residual.data.motion.corner_hz < LEAST_CLEAN_HZ for residual in force.residuals)
    if noisy or force.channel is not ResidualChannel.FORCE:
        return force
    residuals = [residual._replace(after=_force_residual_n(model, residual)) for residual in force.residuals]
    sides = ([r.after[r.used & (r.held_out == side)] for r in residuals] for side in (False, True))
    train, heldout = (math.sqrt(float(np.mean(np.concatenate(side) ** 2))) for side in sides)
    if not train < force.after.train:
        return force
    findings = force.findings
    if train**2 < UNEXPLAINED_SHARE * force.refitted.train**2:
        findings = [finding for finding in findings if finding.effect != "unknown"]
    return force._replace(
        after=force.after._replace(train=train, heldout=heldout), residuals=residuals, findings=findings
    )


def _force_residual_n(model: TwoMassModel, residual: Residual) -> Array:
    """Filtered force residual of the plant along one recording (n,)."""
    data, motor_m = residual.data, residual.data.motion.position_m
    plant = build_plant(model.plant)
    inputs = DrivingInputs(data.period_s, data.force_n, motor_m)
    run = respond(
        plant,
        model.axis,
        values=model.fit.values,
        driven=inputs,
        delay_periods=model.fit.delay_periods,
        dt_s=model.plant.dt_s,
    )
    low_pass = StateFilter(data.period_s, FILTER_HZ)
    motor_kg = float(plant.params[model.axis]["mechanics"]["motor_mass_kg"])
    # at the middle of the period, like the mean force
    between_m = np.append(motor_m[:1], 0.5 * (motor_m[1:] + motor_m[:-1]))
    residual_n: Array = low_pass(run.net_n) - motor_kg * low_pass(between_m, 2)
    return residual_n


def _with_fitted_parameters(one: Explanation, fit: TwoMassFit) -> Explanation:
    """Replace the backlash gap by the fitted one, which excludes flank deflection, and add the damping."""

    def replaced(finding: IdentifiedEffect) -> IdentifiedEffect:
        parameters = dict(finding.parameters)
        if finding.effect == "backlash" and PLAY in fit.values:
            play_m, (low_m, high_m) = fit.values[PLAY], _interval(fit, PLAY)
            under, over = systematic("backlash", "play_m", ResidualChannel.POSITION_DEVIATION)
            parameters["play_m"] = Estimate(play_m, low_m - under * play_m, high_m + over * play_m, "m")
        elif finding.effect == "drive_compliance":
            parameters["damping_n_s_m"] = Estimate(fit.values[DAMPING], *_interval(fit, DAMPING), "N s/m")
        else:
            return finding
        values = {key: estimate.value for key, estimate in parameters.items()}
        return finding._replace(
            parameters=parameters, explanation=meaning_of(finding.effect).sentence(values)
        )

    return one._replace(findings=[replaced(f) for f in one.findings], minor=[replaced(f) for f in one.minor])
