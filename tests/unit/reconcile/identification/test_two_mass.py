"""Spring, damper and play by output error: against motions that another integrator made.

The spring's motion is exact (matrix exponential of two masses, force held); that of the play is made by
Runge-Kutta steps with a smooth friction. Both are read by an encoder and a scale in steps.
"""

import math
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
import pytest
from concealed_machine import write_machine
from scipy.signal import cont2discrete

from hil_sim.config import PlantConfig
from kernels.arrays import Array
from reconcile.identification.two_mass_fit import (
    DAMPING,
    PLAY,
    STIFFNESS,
    FreeParameter,
    TwoMassFit,
    fit_two_mass,
)
from reconcile.identification.two_mass_recording import TwoMassRecording
from reconcile.identification.two_mass_rollout import DrivingInputs
from reconcile.nominal_model.model_file import load_model
from reconcile.replay.replay import plant_of

PERIOD_S, COUNT = 1e-3, 3000
MOTOR_KG, TABLE_KG, VISCOUS_N_S_M, COULOMB_N = 24.99, 45.0, 80.0, 10.0
STEPS_M = (10e-3 / 1048576, 1e-7)


class Truth(NamedTuple):
    stiffness_n_m: float
    damping_n_s_m: float
    play_m: float = 0.0


def plant(folder: Path, truth: Truth) -> PlantConfig:
    """The axis of test_reconcile_own_bus with these values."""
    nominal = load_model(write_machine(folder, {"x": ""}, np.zeros((3, 1))))
    sections = {
        "drive_compliance": {
            "stiffness_n_um": truth.stiffness_n_m * 1e-6,
            "damping_n_s_m": truth.damping_n_s_m,
        },
        "coulomb_friction": {"coulomb_n": COULOMB_N if truth.play_m else 0.0},
    }
    if truth.play_m:
        sections["backlash"] = {"play_um": truth.play_m * 1e6}
    return plant_of(nominal, {"x": sections})


def seen(force_n: Array, motor_m: Array, table_m: Array) -> TwoMassRecording:
    """In steps of the sensors; the force of a sample acts from it on."""
    motor_m, scale_m = (np.round(m / q) * q for m, q in zip((motor_m, table_m), STEPS_M, strict=True))
    judged = np.ones(len(force_n), dtype=np.bool_)
    judged[:200] = False
    return TwoMassRecording(DrivingInputs(PERIOD_S, force_n, motor_m), scale_m, judged, STEPS_M)


def ringing(truth: Truth) -> TwoMassRecording:
    """Two masses under steps of force, exact between the samples."""
    k, c = truth.stiffness_n_m, truth.damping_n_s_m
    a = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-k / MOTOR_KG, -c / MOTOR_KG, k / MOTOR_KG, c / MOTOR_KG],
            [0.0, 0.0, 0.0, 1.0],
            [k / TABLE_KG, c / TABLE_KG, -k / TABLE_KG, -(c + VISCOUS_N_S_M) / TABLE_KG],
        ]
    )
    b = np.array([[0.0], [1.0 / MOTOR_KG], [0.0], [0.0]])
    step, push, *_ = cont2discrete((a, b, np.eye(4), np.zeros((4, 1))), PERIOD_S)
    force_n = np.repeat(np.random.default_rng(1).choice([-15.0, 0.0, 15.0], COUNT // 100), 100)
    state, rows = np.zeros(4), np.zeros((COUNT, 4))
    for i in range(COUNT):
        rows[i] = state
        state = step @ state + push[:, 0] * force_n[i]
    return seen(force_n, rows[:, 0], rows[:, 2])


def bouncing(truth: Truth) -> TwoMassRecording:
    """The same with a play and friction; the force leads the motor to and fro."""
    rows = _bounce(truth.stiffness_n_m, truth.damping_n_s_m, truth.play_m)
    return seen(rows[:, 0], rows[:, 1], rows[:, 2])


@numba.njit
def _bounce(k: float, c: float, b: float) -> Array:
    rows = np.zeros((COUNT, 3))
    y = np.zeros(4)
    substeps = 100
    for i in range(COUNT):
        phase = 2.0 * math.pi * 2.0 * i * PERIOD_S
        wanted_m, wanted_m_s = 2e-3 * math.sin(phase), 2e-3 * 4.0 * math.pi * math.cos(phase)
        force_n = 4e4 * (wanted_m - y[0]) + 2500.0 * (wanted_m_s - y[1])
        rows[i] = force_n, y[0], y[2]
        for _ in range(substeps):
            dt = PERIOD_S / substeps
            one = _slope(y, force_n, k, c, b)
            two = _slope(y + 0.5 * dt * one, force_n, k, c, b)
            three = _slope(y + 0.5 * dt * two, force_n, k, c, b)
            four = _slope(y + dt * three, force_n, k, c, b)
            y = y + dt / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    return rows


@numba.njit
def _slope(y: Array, force_n: float, k: float, c: float, b: float) -> Array:
    gap_m, rate_m_s = y[0] - y[2], y[1] - y[3]
    pressed_m = gap_m - b if gap_m > b else gap_m + b if gap_m < -b else 0.0
    contact_n = k * pressed_m + c * rate_m_s if pressed_m != 0.0 else 0.0
    if contact_n * pressed_m < 0.0:
        contact_n = 0.0
    friction_n = COULOMB_N * math.tanh(y[3] / 2e-5) + VISCOUS_N_S_M * y[3]
    return np.array([y[1], (force_n - contact_n) / MOTOR_KG, y[3], (contact_n - friction_n) / TABLE_KG])


def unknown(name: tuple[str, str], start: float, step: float, *grid: float) -> FreeParameter:
    fine = 0.003 if step > 0.05 else 0.0003
    return FreeParameter(name, start, start / 20.0, 20.0 * start, step, fine, grid or (1.0,))


def fit(folder: Path, truth: Truth, found: TwoMassRecording) -> TwoMassFit:
    unknowns = [
        unknown(STIFFNESS, truth.stiffness_n_m, 0.4, *((0.15, 0.4, 1.0, 2.5) if truth.play_m else ())),
        unknown(DAMPING, truth.damping_n_s_m, 0.3, 0.3, 1.0, 3.0),
        *([unknown(PLAY, truth.play_m, 0.01)] if truth.play_m else []),
    ]
    return fit_two_mass(plant(folder, truth), 0, unknowns, [found])


def test_damping_of_a_ringing_spring_is_found_within_its_interval(tmp_path: Path) -> None:
    truth = Truth(4e7, 2000.0)
    found = fit(tmp_path, Truth(3.8e7, 900.0), ringing(truth))
    for name, value in ((STIFFNESS, truth.stiffness_n_m), (DAMPING, truth.damping_n_s_m)):
        low, high = found.bounds[name]
        assert low < value < high
        assert high < 1.3 * low
    assert abs(found.delay_periods) < 0.05  # a half substep of it is the other integrator's
    assert not found.at_bound


def test_play_and_damping_of_its_flanks_are_found_beside_what_the_repairs_would_write(tmp_path: Path) -> None:
    truth = Truth(2e8, 5000.0, 4e-6)
    found = fit(tmp_path, Truth(2e8, 7500.0, 4.4e-6), bouncing(truth))
    for name, value, within in ((PLAY, truth.play_m, 0.01), (DAMPING, truth.damping_n_s_m, 0.1)):
        assert found.values[name] == pytest.approx(value, rel=within)
    assert np.log(found.blocks).mean() < np.log(found.at_start).mean() - 1.0
