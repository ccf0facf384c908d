"""Closed-loop replay: hil_sim's axis under a known controller, against solutions in closed form."""

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from scipy.signal import cont2discrete

from hil_sim.config import PlantConfig, load_plant
from kernels.arrays import Array
from reconcile.errors import ReconcileError
from reconcile.nominal_model.model_file import load_model, write_model
from reconcile.recording.recording import AxisRecording
from reconcile.replay.controller import Controller, load_controllers
from reconcile.replay.replay import fitted_origin_m, plant_of, remaining_delay_s, replay

T, N = 1e-3, 3000
MASS_KG, VISCOUS_N_S_M = 95.1, 203.5
KP, KV, WINDOW = 160.18, 243.45 * 35.1507, 2
MODEL = f"""
[plant]
name = "emps"
substep_us = 5.0
[axis.x.motor]
torque_constant_nm_a = 0.0139860191
[axis.x.transmission]
lead_mm = 2.5
[axis.x.table]
mass_kg = {MASS_KG}
[axis.x.encoder]
counts_per_rev = 2000000000
[axis.x.viscous_friction]
viscous_n_s_m = {VISCOUS_N_S_M}
[axis.x.controller]
form = "cascade"
sample_time_ms = 1.0
position_gain_1_s = {KP}
velocity_gain_n_s_m = {KV}
velocity_samples = {WINDOW}
"""
TIME_S = np.arange(N, dtype=np.float64) * T
GENTLY = np.sin(0.5 * math.pi * np.minimum(TIME_S / 0.2, 1.0)) ** 4
REFERENCE_M = GENTLY * (0.02 * np.sin(4.4 * TIME_S) + 0.001 * np.sin(56.0 * TIME_S))


def edited(tmp_path: Path, changes: dict[str, dict[str, Any]] | None = None) -> Path:
    """The model file with other values in the axis' sections."""
    document = tomllib.loads(MODEL)
    for section, values in (changes or {}).items():
        document["axis"]["x"][section] = {**document["axis"]["x"].get(section, {}), **values}
    file = tmp_path / "model.toml"
    file.write_text(tomli_w.dumps(document), encoding="utf-8")
    return file


def loaded(file: Path) -> tuple[PlantConfig, Controller]:
    return plant_of(load_model(file)), load_controllers(file)["x"]


def recording_of(motor_m: Array, force_n: Array, reference_m: Array = REFERENCE_M) -> AxisRecording:
    return AxisRecording("r", "x", T, TIME_S, motor_m, force_n, None, reference_m, None, {})


def linear_loop(controller: Controller, delay_s: float = 0.0) -> tuple[Array, Array]:
    """The same loop without friction steps: the plant under a held force solved exactly, piece by piece."""

    a = np.array([[0.0, 1.0], [0.0, -VISCOUS_N_S_M / MASS_KG]])
    push = np.array([[0.0], [1.0 / MASS_KG]])
    f_late, g_late, *_ = cont2discrete((a, push, np.eye(2), np.zeros((2, 1))), max(delay_s, 1e-12))
    f, g, *_ = cont2discrete((a, push, np.eye(2), np.zeros((2, 1))), T - delay_s)
    c = controller
    window = c.velocity_samples
    state, integral = np.zeros(2), 0.0
    places, forces = [0.0] * window, [0.0]
    slope = np.gradient(REFERENCE_M, T)
    for k in range(N):
        velocity = (state[0] - places[-window]) / (window * T)
        wanted = c.position_gain_1_s * (REFERENCE_M[k] - state[0]) + c.velocity_feedforward * slope[k]
        error = wanted - velocity
        integral += c.velocity_integral_n_m * error * T
        places.append(float(state[0]))
        forces.append(c.velocity_gain_n_s_m * error + integral)
        state = f @ (f_late @ state + g_late[:, 0] * forces[-2]) + g[:, 0] * forces[-1]
    return np.array(places[window:]), np.array(forces[1:])


@pytest.mark.parametrize(
    ("change", "delay_s"),
    [
        ({}, 0.0),
        ({"velocity_integral_n_m": 2e4, "velocity_feedforward": 0.8, "velocity_samples": 1}, 0.0),
        ({}, 0.35e-3),
    ],
)
def test_without_dry_friction_it_is_the_linear_loop(
    tmp_path: Path, change: dict[str, Any], delay_s: float
) -> None:
    plant, controller = loaded(edited(tmp_path, {"controller": change}))
    motor_m, force_n = linear_loop(controller, delay_s)
    error = replay(recording_of(motor_m, force_n), plant, controller, delay_s=delay_s).error()
    assert error.force_relative < 0.005  # a substep of 5 us, started from a parabola through 20 samples
    assert error.motor_rms_m < 2e-7


def test_what_is_injected_beside_the_controller_acts_behind_its_limit(tmp_path: Path) -> None:
    plant, controller = loaded(edited(tmp_path, {"controller": {"force_limit_n": 1.0}}))
    rest = np.zeros(N)
    push_n = np.full(N, 40.0)
    found = replay(recording_of(rest, rest, rest), plant, controller, injected_n=push_n)
    assert found.replayed_force_n[-1] == pytest.approx(39.0)  # the loop holds against it with its 1 N
    end_m_s = 39.0 / VISCOUS_N_S_M * (1.0 - math.exp(-VISCOUS_N_S_M / MASS_KG * T * (N - 1)))
    measured_m_s = (found.replayed_motor_m[-1] - found.replayed_motor_m[-2]) / T
    assert measured_m_s == pytest.approx(end_m_s, rel=0.01)


def test_the_zero_shift_is_found_from_the_ripple(tmp_path: Path) -> None:
    ripple = {"harmonic": [1.0], "amplitude_n": [3.0], "phase_deg": [40.0]}
    model: dict[str, dict[str, Any]] = {"cogging": ripple, "coulomb_friction": {"coulomb_n": 10.0}}
    plant, controller = loaded(edited(tmp_path, model))
    rest = recording_of(np.zeros(N), np.zeros(N))
    shift_m = 0.0009
    true = replay(rest, plant, controller, origin_m=shift_m)
    recorded = recording_of(true.replayed_motor_m, true.replayed_force_n)
    found_m = fitted_origin_m(recorded, plant, controller)
    assert found_m == pytest.approx(shift_m, abs=2e-5)
    wrong = replay(recorded, plant, controller).error().force_rms_n
    assert replay(recorded, plant, controller, origin_m=found_m).error().force_rms_n < 0.1 * wrong


def test_a_sample_and_hold_is_no_delay() -> None:
    assert remaining_delay_s(0.75e-3, T) == pytest.approx(0.25e-3)
    assert remaining_delay_s(0.4e-3, T) == 0.0


def test_what_is_replayed_is_the_file_that_hil_sim_runs(tmp_path: Path) -> None:
    file, written = edited(tmp_path, {"coulomb_friction": {"coulomb_n": 10.0}}), tmp_path / "written.toml"
    model = load_model(file)
    del model.document["axis"]["x"]["controller"]  # hil_sim has no room for it
    write_model(model, {}, written)
    assert plant_of(load_model(file)).axes["x"].effects == load_plant(written).axes["x"].effects


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"form": "fuzzy"}, "form"),
        ({"position_gain_1_s": "high"}, "position_gain_1_s"),
        ({"position_gain_1_s": -1.0}, "position_gain_1_s"),
        ({"velocity_samples": 1.5}, "velocity_samples"),
        ({"gain": 1.0}, "gain"),
    ],
)
def test_a_controller_that_cannot_be_used_names_its_key(
    tmp_path: Path, change: dict[str, Any], key: str
) -> None:
    with pytest.raises(ReconcileError, match=f"controller.{key}"):
        load_controllers(edited(tmp_path, {"controller": change}))


def test_a_recording_without_a_reference_is_refused(tmp_path: Path) -> None:
    plant, controller = loaded(edited(tmp_path))
    recording = recording_of(np.zeros(N), np.zeros(N))._replace(reference_m=None)
    with pytest.raises(ReconcileError, match="--map reference"):
        replay(recording, plant, controller)
