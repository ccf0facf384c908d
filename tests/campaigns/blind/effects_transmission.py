"""Draw concealed effects between motor and scale: backlash, compliance, errors of screw and sensors."""

import math

from tests.campaigns.blind.case import Planted
from tests.campaigns.blind.plant import Plant
from tests.campaigns.blind.setting import TURN, Drawn, Setting, fundamental, sign


def backlash(p: Plant, s: Setting) -> Drawn:
    gap_m = math.exp(s.rng.uniform(math.log(2e-6), math.log(40e-6)))
    pressed_m = s.rng.uniform(0.1e-6, 0.25e-6)
    plant = p._replace(backlash_gap_m=gap_m, has_compliance=1.0)
    if p.contact_power == 1.0 and p.has_compliance == 0.0:
        plant = plant._replace(
            contact_stiffness=50.0 / pressed_m**1.5, contact_power=1.5, contact_loss_s_m=3.0
        )
    return plant, Planted("backlash", {"play_m": 0.5 * gap_m}, (), deviation=True, also=("drive_compliance",))


def compliance(p: Plant, s: Setting) -> Drawn:
    stiffness_n_m = math.exp(s.rng.uniform(math.log(12e6), math.log(120e6)))
    reduced_kg = p.motor_kg * p.table_kg / (p.motor_kg + p.table_kg)
    damping = 2.0 * s.rng.uniform(0.02, 0.08) * math.sqrt(stiffness_n_m * reduced_kg)
    plant = p._replace(
        has_compliance=1.0,
        contact_stiffness=stiffness_n_m,
        contact_power=1.0,
        contact_loss_s_m=0.0,
        spring_n_s_m=damping,
    )
    return plant, Planted("drive_compliance", {"stiffness_n_m": stiffness_n_m}, (), deviation=True)


def lead_error_cumulative(p: Plant, s: Setting) -> Drawn:
    share = s.rng.uniform(12e-6, 90e-6) * sign(s.rng)
    truth = Planted("lead_error_cumulative", {"relative_error": share}, (), deviation=True)
    return p._replace(relative_lead_error=share), truth


def lead_error_periodic(p: Plant, s: Setting) -> Drawn:
    amplitude_m = s.rng.uniform(0.8e-6, 5e-6)
    plant = p._replace(
        lead_error_m=amplitude_m,
        lead_error_1_m=TURN / s.lead_m,
        lead_error_phase_rad=s.rng.uniform(0.0, TURN),
        lead_error_second_m=amplitude_m * s.rng.uniform(0.0, 0.3),
    )
    return plant, Planted(
        "lead_error_periodic",
        {"harmonic": 1.0, "amplitude": amplitude_m},
        (),
        deviation=True,
        alike=("encoder_eccentricity",),
    )


def eccentricity(p: Plant, s: Setting) -> Drawn:
    amplitude_m = s.rng.uniform(0.8e-6, 6e-6)
    plant = p._replace(
        eccentricity_m=amplitude_m,
        eccentricity_1_m=TURN / s.lead_m,
        eccentricity_phase_rad=s.rng.uniform(0.0, TURN),
    )
    return plant, Planted(
        "encoder_eccentricity",
        {"harmonic": 1.0, "amplitude": amplitude_m},
        (),
        deviation=True,
        alike=("lead_error_periodic",),
    )


def expansion(p: Plant, _s: Setting) -> Drawn:
    return p, Planted("thermal_expansion", {}, (), deviation=True)


def interpolation_error(p: Plant, s: Setting) -> Drawn:
    period_m = float(s.rng.choice([2e-5, 4e-5, 1e-4, 2e-4, 5e-4]))
    amplitude_m = s.rng.uniform(0.3e-6, 1.5e-6)
    plant = p._replace(
        interpolation_error_m=amplitude_m,
        interpolation_error_1_m=TURN / period_m,
        interpolation_error_phase_rad=s.rng.uniform(0.0, TURN),
        interpolation_error_skew=s.rng.uniform(0.0, 0.4),
    )
    truth = {"period_m": period_m, "amplitude": amplitude_m * fundamental(plant.interpolation_error_skew)}
    return plant, Planted("scale_cyclic_error", truth, (), deviation=True)
