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
        detent_n=amplitude_n,
        detent_1_m=harmonic * TURN / s.lead_m,
        detent_rad=s.rng.uniform(0.0, TURN),
        detent_skew=s.rng.uniform(0.0, 0.5),
    )
    truth = {"harmonic": harmonic, "amplitude": amplitude_n * fundamental(plant.detent_skew)}
    return plant, Planted("cogging", truth, ("detent",))


def torque_ripple(p: Plant, s: Setting) -> Drawn:
    harmonic = float(s.rng.choice([1, 2, 3, 4, 6, 8, 12]))
    plant = p._replace(
        uneven_torque=s.rng.uniform(0.03, 0.1),
        torque_1_m=harmonic * TURN / s.lead_m,
        torque_rad=s.rng.uniform(0.0, TURN),
        torque_skew=s.rng.uniform(0.0, 0.5),
    )
    truth = {"harmonic": harmonic, "amplitude": plant.uneven_torque * fundamental(plant.torque_skew)}
    return plant, Planted("torque_ripple", truth, ("uneven_torque",))


def saturation(p: Plant, s: Setting) -> Drawn:
    loss = s.rng.uniform(0.08, 0.25)
    at_peak = brentq(lambda u: math.atan(u) / u - 1.0 + loss, 1e-3, 3.0)
    plant = p._replace(full_n=s.peak_n / at_peak)
    return plant, Planted("torque_constant_saturation", {}, ("full",))


def lag(p: Plant, s: Setting) -> Drawn:
    time_s = math.exp(s.rng.uniform(math.log(1.5e-3), math.log(7e-3)))
    damping = s.rng.uniform(1.2, 2.0)
    plant = p._replace(slow_rad_s=2.0 * damping / time_s, slow_damping=damping)
    return plant, Planted("current_loop_lag", {"time_s": time_s}, ("slow",))


def delay(p: Plant, s: Setting) -> Drawn:
    time_s = math.exp(s.rng.uniform(math.log(2e-3), math.log(7e-3)))
    return p._replace(late_s=time_s), Planted("transport_delay", {"time_s": time_s}, ("late",))


def dead_zone(p: Plant, s: Setting) -> Drawn:
    lost_n = s.rng.uniform(0.15, 0.5) * p.coulomb_n
    plant = p._replace(lost_n=lost_n, lost_smooth_n=s.rng.uniform(0.05, 0.2) * lost_n)
    return plant, Planted("amplifier_dead_zone", {"threshold_n": lost_n}, ("lost",))


def voltage(p: Plant, s: Setting) -> Drawn:
    plant = p._replace(
        stall_n=s.peak_n * s.rng.uniform(1.2, 2.0),
        no_load_m_s=s.reach.velocity_m_s * s.rng.uniform(1.05, 1.2),
    )
    return plant, Planted("voltage_saturation", {}, ("voltage",))


def weight(p: Plant, s: Setting) -> Drawn:
    force_n = s.rng.uniform(0.3, 1.2) * p.coulomb_n * sign(s.rng)
    alike = ("asymmetric_coulomb_friction",)
    truth = Planted("constant_force", {"force_n": -force_n}, ("weight",), alike=alike)
    return p._replace(weight_n=force_n), truth


def chain(p: Plant, s: Setting) -> Drawn:
    half_m = 0.5 * s.reach.travel_m
    plant = p._replace(
        chain_n=s.rng.uniform(0.25, 0.8) * p.coulomb_n * sign(s.rng),
        chain_at_m=s.rng.uniform(-0.3, 0.3) * half_m,
        chain_m=s.rng.uniform(0.4, 1.2) * half_m,
    )
    return plant, Planted("position_dependent_force", {}, ("chain",), also=("constant_force",))


def hum(p: Plant, s: Setting) -> Drawn:
    frequency_hz = math.exp(s.rng.uniform(math.log(3.0), math.log(35.0)))
    amplitude_n = s.rng.uniform(0.12, 0.4) * p.coulomb_n
    plant = p._replace(
        hum_n=amplitude_n,
        hum_rad_s=TURN * frequency_hz,
        hum_rad=s.rng.uniform(0.0, TURN),
        hum_skew=s.rng.uniform(0.0, 0.4),
    )
    truth = {"frequency_hz": frequency_hz, "amplitude": amplitude_n * fundamental(plant.hum_skew)}
    return plant, Planted("periodic_disturbance", truth, ("hum",))


def tow(p: Plant, s: Setting) -> Drawn:
    mass_kg = s.rng.uniform(0.04, 0.15) * (p.motor_kg + p.table_kg) * sign(s.rng)
    return p._replace(towed_kg=mass_kg), Planted("cross_axis_coupling", {}, ("towed",))
