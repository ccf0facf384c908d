"""Draw concealed forces: of motor and amplifier, weight, cable chain, and other axes."""

import math

from scipy.optimize import brentq

from tests.campaigns.blind.case import Planted
from tests.campaigns.blind.plant import Plant
from tests.campaigns.blind.setting import TURN, Drawn, Setting, fundamental, sign


def cogging(p: Plant, s: Setting) -> Drawn:
    harmonic = float(s.rng.choice([1, 2, 3, 4, 6, 8, 12]))
    amplitude_n = s.rng.uniform(0.12, 0.4) * p.coulomb_n
    plant = p._replace(
        cogging_n=amplitude_n,
        cogging_1_m=harmonic * TURN / s.lead_m,
        cogging_phase_rad=s.rng.uniform(0.0, TURN),
        cogging_skew=s.rng.uniform(0.0, 0.5),
    )
    truth = {"harmonic": harmonic, "amplitude": amplitude_n * fundamental(plant.cogging_skew)}
    return plant, Planted("cogging", truth, ("cogging",))


def torque_ripple(p: Plant, s: Setting) -> Drawn:
    harmonic = float(s.rng.choice([1, 2, 3, 4, 6, 8, 12]))
    plant = p._replace(
        torque_ripple=s.rng.uniform(0.03, 0.1),
        torque_ripple_1_m=harmonic * TURN / s.lead_m,
        torque_ripple_phase_rad=s.rng.uniform(0.0, TURN),
        torque_ripple_skew=s.rng.uniform(0.0, 0.5),
    )
    truth = {"harmonic": harmonic, "amplitude": plant.torque_ripple * fundamental(plant.torque_ripple_skew)}
    return plant, Planted("torque_ripple", truth, ("torque_ripple",))


def torque_constant_saturation(p: Plant, s: Setting) -> Drawn:
    loss = s.rng.uniform(0.08, 0.25)
    at_peak = brentq(lambda u: math.atan(u) / u - 1.0 + loss, 1e-3, 3.0)
    plant = p._replace(saturation_n=s.peak_n / at_peak)
    return plant, Planted("torque_constant_saturation", {}, ("saturation",))


def current_loop_lag(p: Plant, s: Setting) -> Drawn:
    time_s = math.exp(s.rng.uniform(math.log(1.5e-3), math.log(7e-3)))
    damping = s.rng.uniform(1.2, 2.0)
    plant = p._replace(current_loop_rad_s=2.0 * damping / time_s, current_loop_damping=damping)
    return plant, Planted("current_loop_lag", {"time_s": time_s}, ("current_loop",))


def transport_delay(p: Plant, s: Setting) -> Drawn:
    time_s = math.exp(s.rng.uniform(math.log(2e-3), math.log(7e-3)))
    return p._replace(delay_s=time_s), Planted("transport_delay", {"time_s": time_s}, ("delay",))


def dead_zone(p: Plant, s: Setting) -> Drawn:
    lost_n = s.rng.uniform(0.15, 0.5) * p.coulomb_n
    plant = p._replace(dead_zone_n=lost_n, dead_zone_rounding_n=s.rng.uniform(0.05, 0.2) * lost_n)
    return plant, Planted("amplifier_dead_zone", {"threshold_n": lost_n}, ("dead_zone",))


def voltage_saturation(p: Plant, s: Setting) -> Drawn:
    plant = p._replace(
        stall_n=s.peak_n * s.rng.uniform(1.2, 2.0),
        no_load_m_s=s.reach.velocity_m_s * s.rng.uniform(1.05, 1.2),
    )
    return plant, Planted("voltage_saturation", {}, ("voltage",))


def constant(p: Plant, s: Setting) -> Drawn:
    force_n = s.rng.uniform(0.3, 1.2) * p.coulomb_n * sign(s.rng)
    alike = ("asymmetric_coulomb_friction",)
    truth = Planted("constant_force", {"force_n": -force_n}, ("constant",), alike=alike)
    return p._replace(constant_n=force_n), truth


def position_force(p: Plant, s: Setting) -> Drawn:
    half_m = 0.5 * s.reach.travel_m
    plant = p._replace(
        position_force_n=s.rng.uniform(0.25, 0.8) * p.coulomb_n * sign(s.rng),
        position_force_at_m=s.rng.uniform(-0.3, 0.3) * half_m,
        position_force_width_m=s.rng.uniform(0.4, 1.2) * half_m,
    )
    return plant, Planted("position_dependent_force", {}, ("position_force",), also=("constant_force",))


def disturbance(p: Plant, s: Setting) -> Drawn:
    frequency_hz = math.exp(s.rng.uniform(math.log(3.0), math.log(35.0)))
    amplitude_n = s.rng.uniform(0.12, 0.4) * p.coulomb_n
    plant = p._replace(
        disturbance_n=amplitude_n,
        disturbance_rad_s=TURN * frequency_hz,
        disturbance_phase_rad=s.rng.uniform(0.0, TURN),
        disturbance_skew=s.rng.uniform(0.0, 0.4),
    )
    truth = {"frequency_hz": frequency_hz, "amplitude": amplitude_n * fundamental(plant.disturbance_skew)}
    return plant, Planted("periodic_disturbance", truth, ("disturbance",))


def coupling(p: Plant, s: Setting) -> Drawn:
    mass_kg = s.rng.uniform(0.04, 0.15) * (p.motor_kg + p.table_kg) * sign(s.rng)
    return p._replace(coupled_kg=mass_kg), Planted("cross_axis_coupling", {}, ("coupling",))
