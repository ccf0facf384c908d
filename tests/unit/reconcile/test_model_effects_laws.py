"""Model effects predict force and readings as the plant's equations do."""

import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from synthetic_findings import BASE, FORCE, POSITION_DEVIATION, data, friction_w, model_file

from hil_sim.physics.friction import presliding_gms, presliding_lugre, temperature_dependent_friction
from hil_sim.physics.load import periodic_disturbance, position_dependent_force
from hil_sim.physics.motor import amplifier_dead_zone, cogging, torque_constant_saturation, torque_ripple
from hil_sim.physics.sensor import encoder_eccentricity, scale_cyclic_error
from hil_sim.physics.transmission import lead_error_periodic, thermal_expansion
from kernels.arrays import Array
from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.catalogue.registry import ENTRIES
from reconcile.nominal_model.model_effects import model_effects_of
from reconcile.nominal_model.model_file import load_model
from reconcile.nominal_model.model_terms import terms_of_model

RUBBING = f"""
[axis.x.viscous_friction]
viscous_n_s_m = {BASE["viscous_n_s_m"]}
[axis.x.coulomb_friction]
coulomb_n = {BASE["coulomb_n"]}
"""
TURN_RAD_M = 2.0 * math.pi / 5e-3


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> RegressionData:
    return data(tmp_path_factory.mktemp("nominal"))


def _prediction(
    folder: Path, section: str, channel: ResidualChannel, seen: RegressionData
) -> tuple[Array, dict[str, Any], float]:
    """Return the prediction of the model's columns (n,), the plant's parameters, the force constant."""
    file = model_file(folder, extra=RUBBING + section)
    model = load_model(file)
    held = model_effects_of(file, "x", model.document["axis"])
    predicted = np.zeros(len(seen.time_s))
    for model_terms in terms_of_model(model.axes["x"]._replace(model_effects=held), [seen]):
        assert model_terms.channel is channel
        [family] = [f for f in ENTRIES[model_terms.effect].terms if f.channel is channel]
        predicted += family.columns(seen, model_terms.shape_parameters) @ np.array(model_terms.coefficients)
    return predicted, held.effects, model.axes["x"].force_constant_n_a


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


WAVES: dict[str, tuple[str, Callable[[Any, RegressionData, int], float]]] = {
    "cogging": (
        "harmonic = [4.0, 7.0]\namplitude_n = [2.0, -1.0]\nphase_deg = [30.0, 250.0]\n",
        lambda p, s, i: -cogging.force_n(p, s.motion.position_m[i], TURN_RAD_M),
    ),
    "torque_ripple": (
        "harmonic = [4.0, 7.0]\namplitude = [0.02, -0.01]\nphase_deg = [30.0, 250.0]\n",
        lambda p, s, i: (
            -torque_ripple.relative_ripple(p, s.motion.position_m[i], TURN_RAD_M) * float(s.model_force_n[i])
        ),
    ),
    "periodic_disturbance": (
        "amplitude_n = 2.0\nfrequency_hz = 13.0\nphase_deg = 200.0\n",
        lambda p, s, i: -periodic_disturbance.force_n(p, s.time_s[i]),
    ),
    "position_dependent_force": (
        "centre_mm = 5.0\nhalf_travel_mm = 80.0\npower_1_n = 3.0\npower_3_n = -2.0\n",
        lambda p, s, i: -position_dependent_force.force_n(p, s.motion.position_m[i], TURN_RAD_M),
    ),
    "lead_error_periodic": (
        "amplitude_um = 3.0\nharmonic = 2.0\nphase_deg = 100.0\n",
        lambda p, s, i: lead_error_periodic.error_m(p, s.motion.position_m[i], TURN_RAD_M),
    ),
    "encoder_eccentricity": (
        "amplitude_um = 3.0\nphase_deg = 100.0\n",
        lambda p, s, i: -encoder_eccentricity.error_m(p, s.motion.position_m[i], TURN_RAD_M),
    ),
    "scale_cyclic_error": (
        "amplitude_um = 0.3\nperiod_um = 20.0\nphase_deg = -100.0\n",
        lambda p, s, i: scale_cyclic_error.error_m(p, s.motion.position_m[i], TURN_RAD_M),
    ),
}
READINGS = ("lead_error_periodic", "encoder_eccentricity", "scale_cyclic_error")


@pytest.mark.parametrize("effect", WAVES)
def test_waves_and_cubics_are_those_of_the_plant(tmp_path: Path, seen: RegressionData, effect: str) -> None:
    keys, law = WAVES[effect]
    channel = POSITION_DEVIATION if effect in READINGS else FORCE
    predicted, effects, _ = _prediction(tmp_path, f"[axis.x.{effect}]\n{keys}", channel, seen)
    places = range(0, len(predicted), 37)
    plant = np.array([law(effects[effect], seen, i) for i in places])
    assert predicted[places] == pytest.approx(plant, abs=1e-9 * _rms(plant))


def test_lost_force_is_that_of_the_plant(tmp_path: Path, seen: RegressionData) -> None:
    """Exact at the peak of the force; below it the entry is cubic, and the dead zone has a width."""
    for section, key, law, within in (
        ("torque_constant_saturation", "saturation_a = 0.2", torque_constant_saturation, 0.06),
        ("amplifier_dead_zone", "threshold_a = 0.01", amplifier_dead_zone, 0.08),
    ):
        text = f"[axis.x.{section}]\n{key}\n"
        predicted_n, effects, constant_n_a = _prediction(tmp_path, text, FORCE, seen)
        asked_a = (seen.model_force_n + predicted_n) / constant_n_a
        passed_a = [law.force_producing_a(effects[section], float(a), 0.0, 0.0) for a in asked_a]
        missing_n = seen.model_force_n - np.array(passed_a) * constant_n_a
        assert abs(missing_n[np.argmax(np.abs(seen.model_force_n))]) < 1e-9
        assert _rms(missing_n) < within * _rms(predicted_n), section


@pytest.mark.parametrize(("law", "within"), [("lugre", 1e-9), ("gms", 0.15)])
def test_contact_of_bristles_or_elements_builds_up_as_an_exponential(
    tmp_path: Path, seen: RegressionData, law: str, within: float
) -> None:
    """All the Coulomb friction does, so with the base's column the columns are the contact's force."""
    t = seen.time_s[:4000]
    x = 3e-5 * np.sin(math.pi * t) + 1.2e-5 * (np.sin(8.0 * t + 1.0) - math.sin(1.0))
    motion = seen.motion._replace(position_m=x, direction=np.sign(np.gradient(x)))
    small = seen._replace(time_s=t, motion=motion)
    section = {
        "lugre": "[axis.x.presliding_lugre]\nstiffness_n_um = 2.0\nbristle_damping_n_s_m = 0.0\n",
        "gms": (
            "[axis.x.presliding_gms]\nshare = [0.3, 0.3, 0.2, 0.2]\nstiffness_n_um = [2.0, 1.0, 0.4, 0.15]\n"
            "attraction_n_s = 1e4\nmicro_damping_n_s_m = 0.0\n"
        ),
    }[law]
    predicted_n, effects, _ = _prediction(tmp_path, section, FORCE, small)
    state = SimpleNamespace(
        bristle_m=0.0, element_n=np.zeros(8), slipping=np.zeros(8, np.int64), slip_direction=0.0
    )
    kernels: Any = presliding_lugre if law == "lugre" else presliding_gms
    plant_n = [0.0]
    for step_m in np.diff(x):
        given = (effects[f"presliding_{law}"], state, float(step_m) / 1e-3, BASE["coulomb_n"])
        kernels.slide.py_func(*given, 1e-3)
        plant_n.append(kernels.force_and_damping.py_func(*given)[0])
    off_n = BASE["coulomb_n"] * motion.direction + predicted_n - np.array(plant_n)
    assert _rms(off_n) < within * _rms(np.array(plant_n))


def _lubricant(scale_k: float, capacity_j_k: float) -> str:
    return (
        "[axis.x.temperature_dependent_friction]\nwarm_level_share = 0.4\nwarm_damping_share = 0.7\n"
        f"warmth_scale_k = {scale_k}\nheat_capacity_j_k = {capacity_j_k}\nresistance_k_w = 10.0\n"
    )


@pytest.mark.parametrize(
    ("scale_k", "capacity_j_k", "within"),
    [
        (40.0, 1.0, 0.06),  # nearly straight
        (4.0, 1.0, 0.35),  # strongly bent, and the entry's change is that in the end
        (4.0, 100.0, 0.02),  # its beginning alone: straight, though a line to the end would be far off
    ],
)
def test_friction_drifts_as_the_plants(
    tmp_path: Path, seen: RegressionData, scale_k: float, capacity_j_k: float, within: float
) -> None:
    """Under the mean power; how far off the straight line is depends on how much of the bend is seen."""
    predicted_n, effects, _ = _prediction(tmp_path, _lubricant(scale_k, capacity_j_k), FORCE, seen)
    p, State = effects["temperature_dependent_friction"], temperature_dependent_friction.State
    time_s = p.resistance_k_w * p.heat_capacity_j_k
    warmth_k = friction_w(seen).mean() * p.resistance_k_w * -np.expm1(-seen.time_s / time_s)
    factors = np.array([temperature_dependent_friction.factors(p, State(float(k)), 0.0) for k in warmth_k])
    m = seen.motion
    plant_n = BASE["coulomb_n"] * m.direction * (factors[:, 0] - 1.0)
    plant_n += BASE["viscous_n_s_m"] * m.velocity_m_s * (factors[:, 1] - 1.0)
    assert _rms(predicted_n - plant_n) < within * _rms(plant_n)


@pytest.mark.parametrize(
    ("heat_share", "ambient", "start"), [(1.0, 20.0, 20.0), (0.0, 24.0, 20.0), (0.5, 18.0, 23.0)]
)
def test_screw_grows_as_the_plants(
    tmp_path: Path, seen: RegressionData, heat_share: float, ambient: float, start: float
) -> None:
    """But for where the readings begin, which is free in every model."""
    section = (
        "[axis.x.thermal_expansion]\nexpansion_um_m_k = 12.0\nfixed_end_mm = -200.0\nreference_degc = 20.0\n"
        f"start_degc = {start}\nambient_degc = {ambient}\nheat_capacity_j_k = 2.0\nresistance_k_w = 5.0\n"
        f"heat_share = {heat_share}\n"
    )
    predicted_m, effects, _ = _prediction(tmp_path, section, POSITION_DEVIATION, seen)
    p = effects["thermal_expansion"]
    kept = math.exp(-seen.period_s / 10.0)
    flow_w = np.full(len(seen.time_s), p.heat_share * friction_w(seen).mean())
    rise_k = lfilter(
        [0.0, 5.0 * (1.0 - kept)], [1.0, -kept], flow_w + (p.ambient_k - p.start_k) / p.resistance_k_w
    )
    x = seen.motion.position_m
    plant_m = np.array(
        [
            thermal_expansion.error_m(p, thermal_expansion.State(p.start_k + float(k)), float(a), TURN_RAD_M)
            for a, k in zip(x, rise_k, strict=True)
        ]
    )
    off_m = predicted_m - plant_m
    assert np.std(off_m) < 1e-6 * _rms(plant_m)
