"""A plant led along a measured motion needs the force of that motion, at its time, up to the ends."""

import math

import numpy as np
import pytest
from nominal_model_text import WITHOUT_SCALE

from hil_sim.config import PlantConfig
from kernels.arrays import Array
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import AxisRecording
from reconcile.replay.model_along_motion import along_motion
from reconcile.replay.replay import plant_of

T = 1e-3
MASS_KG, VISCOUS_N_S_M = 50.0, 100.0
MODEL = WITHOUT_SCALE.split("[axis.x.coulomb_friction]")[0]


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> PlantConfig:
    file = tmp_path_factory.mktemp("rigid") / "plant.toml"
    file.write_text(MODEL, encoding="utf-8")
    return plant_of(load_model(file))


def led_force_n(plant: PlantConfig, position_m: Array) -> Array:
    recording = AxisRecording(
        source="motion",
        axis="x",
        period_s=T,
        time_s=np.arange(len(position_m)) * T,
        motor_m=position_m,
        force_n=np.zeros(len(position_m)),
        scale_m=None,
        reference_m=None,
        temperature_k=None,
        others={},
    )
    return along_motion(recording, plant).force_n


def test_the_force_is_that_of_the_motion_at_the_same_time(plant: PlantConfig) -> None:
    """Its jerk is large: a force read one cycle early or late would be 19 % of it away."""
    rad_s, time_s = 2.0 * math.pi * 30.0, np.arange(2000) * T
    force_n = led_force_n(plant, 1e-4 * np.sin(rad_s * time_s))
    sine, cosine = np.sin(rad_s * time_s), np.cos(rad_s * time_s)
    inside = slice(200, 1800)
    columns = np.stack((sine, cosine), axis=1)[inside]
    in_phase_n, ahead_n = np.linalg.lstsq(columns, force_n[inside], rcond=None)[0]
    # the low pass at 200 Hz takes 0.8 % of a motion at 30 Hz, and shifts nothing
    gain = math.exp(-0.5 * math.log(2.0) * (30.0 / 200.0) ** 2)
    assert in_phase_n == pytest.approx(-MASS_KG * 1e-4 * rad_s**2 * gain, rel=0.01)
    assert ahead_n == pytest.approx(VISCOUS_N_S_M * 1e-4 * rad_s * gain, abs=0.01 * abs(in_phase_n))


def test_a_recording_may_end_in_motion(plant: PlantConfig) -> None:
    force_n = led_force_n(plant, 0.04 * np.arange(600) * T)
    settled_n = force_n[10:]
    assert settled_n == pytest.approx(np.full(590, VISCOUS_N_S_M * 0.04), rel=0.01)
