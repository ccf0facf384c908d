"""What can be concealed: how large, in which parameters of the plant, under which name."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.optimize import brentq

from tests.blind.case import Planted
from tests.blind.simulate import wave

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.blind.motions import Reach
    from tests.blind.plant import Plant

    Random = np.random.Generator

TURN = 2.0 * math.pi


class Setting(NamedTuple):
    """What the size of an effect depends on."""

    lead_m: float
    reach: Reach
    peak_n: float
    """The strongest force of its motions, about."""
    rng: Random


Drawn = tuple["Plant", Planted]


def sign(rng: Random) -> float:
    """One of the two."""
    return 1.0 if rng.random() < 0.5 else -1.0


def fundamental(skew: float) -> float:
    """Amplitude of the first harmonic of `simulate.wave`."""
    angle = np.linspace(0.0, TURN, 720, endpoint=False)
    return float(2.0 * abs(np.mean(wave(angle, skew) * np.exp(-1j * angle))))


def _asymmetric_coulomb(p: Plant, s: Setting) -> Drawn:
    half_n = s.rng.uniform(0.12, 0.35) * p.coulomb_n * sign(s.rng)
    truth = Planted(
        "asymmetric_coulomb_friction", {"force_n": -half_n}, ("uneven",), alike=("constant_force",)
    )
    return p._replace(uneven_n=half_n), truth


def _asymmetric_viscous(p: Plant, s: Setting) -> Drawn:
    half = s.rng.uniform(0.2, 0.45) * p.viscous_n_s_m * sign(s.rng)
    truth = Planted("asymmetric_viscous_friction", {"half_difference_n_s_m": half}, ("uneven_viscous",))
    return p._replace(uneven_n_s_m=half), truth


def _stribeck(p: Plant, s: Setting) -> Drawn:
    rise_n = s.rng.uniform(0.3, 0.8) * p.coulomb_n
    speed_m_s = math.exp(s.rng.uniform(math.log(1.5e-3), math.log(15e-3)))
    plant = p._replace(rise_n=rise_n, rise_m_s=speed_m_s, rise_power=s.rng.uniform(1.6, 2.4))
    return plant, Planted("stribeck_friction", {}, ("rise",))


def _drag(p: Plant, s: Setting) -> Drawn:
    power = s.rng.uniform(1.8, 2.2)
    drag = s.rng.uniform(0.5, 1.2) * p.coulomb_n / s.reach.velocity_m_s**power
    return p._replace(drag=drag, drag_power=power), Planted("quadratic_viscous_friction", {}, ("drag",))


def _presliding(p: Plant, s: Setting) -> Drawn:
    way_m = math.exp(s.rng.uniform(math.log(12e-6), math.log(80e-6)))
    plant = p._replace(way_m=way_m, sharpness=s.rng.uniform(1.3, 3.0), unloading=s.rng.uniform(0.35, 0.6))
    return plant, Planted("presliding_hysteresis", {}, ("presliding",))


def _dwell(p: Plant, s: Setting) -> Drawn:
    age_s, after_s = s.rng.uniform(0.2, 0.8), 3.0
    age_n = s.rng.uniform(0.3, 0.8) * p.coulomb_n / math.log1p(after_s / age_s)
    plant = p._replace(age_n=age_n, age_s=age_s, age_m=s.rng.uniform(1e-5, 5e-5))
    return plant, Planted("dwell_dependent_breakaway", {}, ("age",))


def _worn(p: Plant, s: Setting) -> Drawn:
    half_m = 0.5 * s.reach.travel_m
    plant = p._replace(
        worn_n=s.rng.uniform(0.15, 0.4) * p.coulomb_n * sign(s.rng),
        worn_at_m=s.rng.uniform(-0.3, 0.3) * half_m,
        worn_m=s.rng.uniform(0.3, 1.0) * half_m,
    )
    return plant, Planted("position_dependent_friction", {}, ("worn",))


def _thin(p: Plant, s: Setting) -> Drawn:
    return p._replace(thin=s.rng.uniform(0.15, 0.4)), Planted("temperature_dependent_friction", {}, ("thin",))


def _backlash(p: Plant, s: Setting) -> Drawn:
    gap_m = math.exp(s.rng.uniform(math.log(2e-6), math.log(40e-6)))
    pressed_m = s.rng.uniform(0.1e-6, 0.25e-6)
    plant = p._replace(gap_m=gap_m, flexible=1.0)
    if p.contact_power == 1.0 and p.flexible == 0.0:
        plant = plant._replace(contact=50.0 / pressed_m**1.5, contact_power=1.5, contact_loss_s_m=3.0)
    return plant, Planted("backlash", {"play_m": 0.5 * gap_m}, (), deviation=True, also=("drive_compliance",))


def _compliance(p: Plant, s: Setting) -> Drawn:
    stiffness_n_m = math.exp(s.rng.uniform(math.log(12e6), math.log(120e6)))
    reduced_kg = p.motor_kg * p.table_kg / (p.motor_kg + p.table_kg)
    damping = 2.0 * s.rng.uniform(0.02, 0.08) * math.sqrt(stiffness_n_m * reduced_kg)
    plant = p._replace(
        flexible=1.0, contact=stiffness_n_m, contact_power=1.0, contact_loss_s_m=0.0, spring_n_s_m=damping
    )
    return plant, Planted("drive_compliance", {"stiffness_n_m": stiffness_n_m}, (), deviation=True)


def _stretch(p: Plant, s: Setting) -> Drawn:
    share = s.rng.uniform(12e-6, 90e-6) * sign(s.rng)
    truth = Planted("lead_error_cumulative", {"relative_error": share}, (), deviation=True)
    return p._replace(stretch=share), truth


def _wobble(p: Plant, s: Setting) -> Drawn:
    amplitude_m = s.rng.uniform(0.8e-6, 5e-6)
    plant = p._replace(
        wobble_m=amplitude_m,
        wobble_1_m=TURN / s.lead_m,
        wobble_rad=s.rng.uniform(0.0, TURN),
        wobble_2_m=amplitude_m * s.rng.uniform(0.0, 0.3),
    )
    return plant, Planted(
        "lead_error_periodic",
        {"harmonic": 1.0, "amplitude": amplitude_m},
        (),
        deviation=True,
        alike=("encoder_eccentricity",),
    )


def _eccentric(p: Plant, s: Setting) -> Drawn:
    amplitude_m = s.rng.uniform(0.8e-6, 6e-6)
    plant = p._replace(
        eccentric_m=amplitude_m, eccentric_1_m=TURN / s.lead_m, eccentric_rad=s.rng.uniform(0.0, TURN)
    )
    return plant, Planted(
        "encoder_eccentricity",
        {"harmonic": 1.0, "amplitude": amplitude_m},
        (),
        deviation=True,
        alike=("lead_error_periodic",),
    )


def _expansion(p: Plant, _s: Setting) -> Drawn:
    return p, Planted("thermal_expansion", {}, (), deviation=True)


def _cyclic(p: Plant, s: Setting) -> Drawn:
    period_m = float(s.rng.choice([2e-5, 4e-5, 1e-4, 2e-4, 5e-4]))
    amplitude_m = s.rng.uniform(0.3e-6, 1.5e-6)
    plant = p._replace(
        cyclic_m=amplitude_m,
        cyclic_1_m=TURN / period_m,
        cyclic_rad=s.rng.uniform(0.0, TURN),
        cyclic_skew=s.rng.uniform(0.0, 0.4),
    )
    truth = {"period_m": period_m, "amplitude": amplitude_m * fundamental(plant.cyclic_skew)}
    return plant, Planted("scale_cyclic_error", truth, (), deviation=True)


def _cogging(p: Plant, s: Setting) -> Drawn:
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


def _torque_ripple(p: Plant, s: Setting) -> Drawn:
    harmonic = float(s.rng.choice([1, 2, 3, 4, 6, 8, 12]))
    plant = p._replace(
        uneven_torque=s.rng.uniform(0.03, 0.1),
        torque_1_m=harmonic * TURN / s.lead_m,
        torque_rad=s.rng.uniform(0.0, TURN),
        torque_skew=s.rng.uniform(0.0, 0.5),
    )
    truth = {"harmonic": harmonic, "amplitude": plant.uneven_torque * fundamental(plant.torque_skew)}
    return plant, Planted("torque_ripple", truth, ("uneven_torque",))


def _saturation(p: Plant, s: Setting) -> Drawn:
    loss = s.rng.uniform(0.08, 0.25)
    at_peak = brentq(lambda u: math.atan(u) / u - 1.0 + loss, 1e-3, 3.0)
    plant = p._replace(full_n=s.peak_n / at_peak)
    return plant, Planted("torque_constant_saturation", {}, ("full",))


def _lag(p: Plant, s: Setting) -> Drawn:
    time_s = math.exp(s.rng.uniform(math.log(1.5e-3), math.log(7e-3)))
    damping = s.rng.uniform(1.2, 2.0)
    plant = p._replace(slow_rad_s=2.0 * damping / time_s, slow_damping=damping)
    return plant, Planted("current_loop_lag", {"time_s": time_s}, ("slow",))


def _delay(p: Plant, s: Setting) -> Drawn:
    time_s = math.exp(s.rng.uniform(math.log(2e-3), math.log(7e-3)))
    return p._replace(late_s=time_s), Planted("transport_delay", {"time_s": time_s}, ("late",))


def _dead_zone(p: Plant, s: Setting) -> Drawn:
    lost_n = s.rng.uniform(0.15, 0.5) * p.coulomb_n
    plant = p._replace(lost_n=lost_n, lost_smooth_n=s.rng.uniform(0.05, 0.2) * lost_n)
    return plant, Planted("amplifier_dead_zone", {"threshold_n": lost_n}, ("lost",))


def _voltage(p: Plant, s: Setting) -> Drawn:
    plant = p._replace(
        stall_n=s.peak_n * s.rng.uniform(1.2, 2.0),
        no_load_m_s=s.reach.velocity_m_s * s.rng.uniform(1.05, 1.2),
    )
    return plant, Planted("voltage_saturation", {}, ("voltage",))


def _weight(p: Plant, s: Setting) -> Drawn:
    force_n = s.rng.uniform(0.3, 1.2) * p.coulomb_n * sign(s.rng)
    alike = ("asymmetric_coulomb_friction",)
    truth = Planted("constant_force", {"force_n": -force_n}, ("weight",), alike=alike)
    return p._replace(weight_n=force_n), truth


def _chain(p: Plant, s: Setting) -> Drawn:
    half_m = 0.5 * s.reach.travel_m
    plant = p._replace(
        chain_n=s.rng.uniform(0.25, 0.8) * p.coulomb_n * sign(s.rng),
        chain_at_m=s.rng.uniform(-0.3, 0.3) * half_m,
        chain_m=s.rng.uniform(0.4, 1.2) * half_m,
    )
    return plant, Planted("position_dependent_force", {}, ("chain",), also=("constant_force",))


def _hum(p: Plant, s: Setting) -> Drawn:
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


def _tow(p: Plant, s: Setting) -> Drawn:
    mass_kg = s.rng.uniform(0.04, 0.15) * (p.motor_kg + p.table_kg) * sign(s.rng)
    return p._replace(towed_kg=mass_kg), Planted("cross_axis_coupling", {}, ("towed",))


CATALOGUE: dict[str, Callable[[Plant, Setting], Drawn]] = {
    "asymmetric_coulomb_friction": _asymmetric_coulomb,
    "asymmetric_viscous_friction": _asymmetric_viscous,
    "stribeck_friction": _stribeck,
    "quadratic_viscous_friction": _drag,
    "presliding_hysteresis": _presliding,
    "dwell_dependent_breakaway": _dwell,
    "position_dependent_friction": _worn,
    "temperature_dependent_friction": _thin,
    "backlash": _backlash,
    "drive_compliance": _compliance,
    "lead_error_cumulative": _stretch,
    "lead_error_periodic": _wobble,
    "encoder_eccentricity": _eccentric,
    "thermal_expansion": _expansion,
    "cogging": _cogging,
    "torque_ripple": _torque_ripple,
    "torque_constant_saturation": _saturation,
    "current_loop_lag": _lag,
    "amplifier_dead_zone": _dead_zone,
    "transport_delay": _delay,
    "voltage_saturation": _voltage,
    "scale_cyclic_error": _cyclic,
    "constant_force": _weight,
    "position_dependent_force": _chain,
    "periodic_disturbance": _hum,
    "cross_axis_coupling": _tow,
}
"""Every effect of the catalogue but `payload_mass`, which no model that fits its mass can miss."""
COMMAND_ONLY = frozenset({"current_loop_lag", "amplifier_dead_zone", "transport_delay", "voltage_saturation"})
"""Between command and current: a measured current holds them already."""
CONFLICTS = (
    {"asymmetric_coulomb_friction", "constant_force"},
    {"lead_error_periodic", "encoder_eccentricity"},
    {"current_loop_lag", "transport_delay"},
    {"lead_error_periodic", "backlash"},
    {"torque_constant_saturation", "voltage_saturation"},
)
"""Not planted together: one class, or more than the other's size."""
