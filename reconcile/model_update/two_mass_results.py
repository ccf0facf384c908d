"""What the two-mass model changes: sections of the plant file, findings, and the residual of the force."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from hil_sim.config import build_plant
from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.registry import systematic
from reconcile.catalogue.unnamed_terms import meaning_of
from reconcile.identification.explain import Explanation, ResidualRms
from reconcile.identification.findings import IdentifiedEffect
from reconcile.identification.parameter_estimates import Estimate
from reconcile.identification.two_mass import MOTOR, TABLE, VISCOUS, TwoMassModel
from reconcile.identification.two_mass_fit import COULOMB, DAMPING, PLAY, STIFFNESS, TwoMassFit
from reconcile.identification.two_mass_rollout import DrivingInputs, respond
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.regression_data import LEAST_CLEAN_HZ
from reconcile.regression.residual import Residual
from reconcile.regression.state_filter import StateFilter

BESIDE_THE_SPRING = {TABLE, MOTOR, COULOMB, VISCOUS}
"""What the force tells as well."""
UNEXPLAINED_SHARE = 0.25
"""Share of the refitted squares below which an `unknown` in the force is explained by this model."""
DAMPING_INTERVAL_FACTORS = (0.9, 1.0)
"""Factors on the damping's interval. Calibrated on six concealed springs of 70 to 330 N/um, whose ringing a
recording at 1 kHz hardly shows: the damping was identified 1 to 9 % too high."""


def two_mass_results(
    model: TwoMassModel, explanations: Sequence[Explanation], lead_m: float
) -> tuple[dict[str, dict[str, Any]], list[Explanation]]:
    """Return sections of a plant file, in its units, and the explanations with what this plant leaves.

    Masses and friction that leave more of the force than a refitted rigid model are not in the sections:
    friction that the plant lacks, as a presliding, has drawn them. The force residual becomes that of this
    plant where it is smaller; that of the deviation stays the columns', because a second diagnosis starts
    from it.
    """
    force = next(one for one in explanations if one.channel is ResidualChannel.FORCE)
    by_plant = _force_of(model, force)
    serves_force = by_plant is None or by_plant[1].train <= force.refitted.train
    others = [one for one in explanations if one is not force]
    after = [_with_fitted_parameters(one, model.fit) for one in (_with_force(force, by_plant), *others)]
    return _plant_sections(model.fit, lead_m, serves_force=serves_force), after


def _plant_sections(fit: TwoMassFit, lead_m: float, *, serves_force: bool) -> dict[str, dict[str, Any]]:
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
    for name, value in fit.values.items():
        if name in BESIDE_THE_SPRING and not serves_force:
            continue
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


def _with_force(force: Explanation, by_plant: tuple[list[Residual], ResidualRms] | None) -> Explanation:
    if by_plant is None or not by_plant[1].train < force.after.train:
        return force
    residuals, after = by_plant
    findings = force.findings
    if after.train**2 < UNEXPLAINED_SHARE * force.refitted.train**2:
        findings = [finding for finding in findings if finding.effect != "unknown"]
    return force._replace(after=after, residuals=residuals, findings=findings)


def _force_of(model: TwoMassModel, force: Explanation) -> tuple[list[Residual], ResidualRms] | None:
    """Return what the plant leaves of the force; None where positions are noisy."""
    if any(residual.data.motion.corner_hz < LEAST_CLEAN_HZ for residual in force.residuals):
        return None
    residuals = [residual._replace(after=_force_residual_n(model, residual)) for residual in force.residuals]
    sides = ([r.after[r.used & (r.held_out == side)] for r in residuals] for side in (False, True))
    return residuals, ResidualRms(*(math.sqrt(float(np.mean(np.concatenate(side) ** 2))) for side in sides))


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
