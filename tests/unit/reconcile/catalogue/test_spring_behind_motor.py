"""Two masses and a spring, seen from the motor alone, against SciPy's simulation of their motion."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import bilinear, lsim

from kernels.arrays import Array
from reconcile.catalogue import spring_behind_motor
from reconcile.diagnosis.diagnose import diagnose
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import AxisRecording
from reconcile.regression.regression_data import regression_data

MOTOR_KG, LOAD_KG, STIFFNESS_N_M, DAMPING_N_S_M, VISCOUS_N_S_M = 2.0, 3.0, 2.4e5, 60.0, 40.0
PERIOD_S, SECONDS, ENCODER_M = 5e-4, 8.0, 2e-8
ANTIRESONANCE_HZ = math.sqrt(STIFFNESS_N_M / LOAD_KG) / (2.0 * math.pi)
NOMINAL = """
[axis.x]
transmission.lead_mm = 10.0
motor.torque_constant_nm_a = 1.0
table.mass_kg = 5.0
"""


def noise_force(seed: int) -> Array:
    """A random force of all frequencies up to about 100 Hz."""
    rng = np.random.default_rng(seed)
    white = rng.normal(size=round(SECONDS / PERIOD_S))
    spectrum, hertz = np.fft.rfft(white), np.fft.rfftfreq(len(white), PERIOD_S)
    spectrum[(hertz < 2.0) | (hertz > 100.0)] = 0.0
    force: Array = np.fft.irfft(spectrum, len(white))
    return 200.0 * force / force.std()


def slow_force() -> Array:
    return 200.0 * np.sin(2.0 * math.pi * 1.3 * np.arange(round(SECONDS / PERIOD_S)) * PERIOD_S)


def driven(force_n: Array, seed: int) -> AxisRecording:
    """The motor's position by the state equations, rounded to the encoder; 0.5 N of noise on the force."""
    k, c = STIFFNESS_N_M, DAMPING_N_S_M
    a = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-k / MOTOR_KG, -(c + VISCOUS_N_S_M) / MOTOR_KG, k / MOTOR_KG, c / MOTOR_KG],
            [0.0, 0.0, 0.0, 1.0],
            [k / LOAD_KG, c / LOAD_KG, -k / LOAD_KG, -c / LOAD_KG],
        ]
    )
    b = np.array([[0.0], [1.0 / MOTOR_KG], [0.0], [0.0]])
    time_s = np.arange(len(force_n)) * PERIOD_S
    _, motor_m, _ = lsim((a, b, np.array([[1.0, 0.0, 0.0, 0.0]]), np.zeros((1, 1))), force_n, time_s)
    motor_m = np.round(np.asarray(motor_m) / ENCODER_M) * ENCODER_M
    measured_n = force_n + np.random.default_rng(seed + 50).normal(scale=0.5, size=len(force_n))
    return AxisRecording(f"drive {seed}", "x", PERIOD_S, time_s, motor_m, measured_n, None, None, None, {})


def nominal_file(directory: Path) -> Path:
    file = directory / "nominal.toml"
    file.write_text(NOMINAL, encoding="utf-8")
    return file


def written(recording: AxisRecording, file: Path) -> Path:
    rows = np.stack((recording.time_s, recording.motor_m, recording.force_n), axis=1)
    header = "time_s,motor_position_m,motor_force_n"
    np.savetxt(file, rows, fmt="%.10g", delimiter=",", header=header, comments="")
    return file


@pytest.mark.parametrize("hertz", [3.0, 30.0, 60.0, 90.0])
def test_the_column_is_the_force_that_a_load_on_a_spring_takes_beyond_a_rigid_one(hertz: float) -> None:
    w, own = 2.0 * math.pi * hertz, 2.0 * math.pi * ANTIRESONANCE_HZ
    ratio = DAMPING_N_S_M / (2.0 * LOAD_KG * own)
    time_s = np.arange(round(6.0 / PERIOD_S)) * PERIOD_S
    column = spring_behind_motor.column(1e-3 * np.sin(w * time_s), PERIOD_S, ANTIRESONANCE_HZ, ratio)
    steady = time_s > 4.0
    basis = np.stack((np.sin(w * time_s), np.cos(w * time_s)), axis=1)[steady]
    (real, imaginary), *_ = np.linalg.lstsq(basis, column[steady], rcond=None)
    spring = 2j * ratio * own * w + own**2
    expected = 1e-3 * -(w**2) * (spring / (spring - w**2) - 1.0)
    assert complex(real, imaginary) == pytest.approx(expected, rel=0.04, abs=0.01 * abs(expected))


def test_the_deflection_is_discretised_by_the_bilinear_transform() -> None:
    w, damping_ratio, period_s = 2.0 * math.pi * 54.0, 0.08, 5e-4
    expected = bilinear([1.0, 0.0, 0.0], [1.0, 2.0 * damping_ratio * w, w * w], 1.0 / period_s)
    taps = spring_behind_motor._deflection_taps(w, damping_ratio, period_s)
    np.testing.assert_allclose(taps, expected, rtol=1e-12)


def test_frequency_and_damping_are_those_of_the_load_on_its_spring(tmp_path: Path) -> None:
    axis = load_model(nominal_file(tmp_path)).axes["x"]
    data = [regression_data(driven(noise_force(seed), seed), axis) for seed in (1, 2)]
    ((frequency_hz, ratio),) = spring_behind_motor.shapes(data)
    assert frequency_hz == pytest.approx(ANTIRESONANCE_HZ, rel=0.01)
    expected = DAMPING_N_S_M / (2.0 * math.sqrt(STIFFNESS_N_M * LOAD_KG))
    assert ratio == pytest.approx(expected, rel=0.15)


def test_nothing_is_claimed_of_a_spring_that_the_motion_does_not_excite(tmp_path: Path) -> None:
    axis = load_model(nominal_file(tmp_path)).axes["x"]
    assert spring_behind_motor.shapes([regression_data(driven(slow_force(), 1), axis)]) == []


def test_a_rigid_axis_under_noise_has_no_spring(tmp_path: Path) -> None:
    axis = load_model(nominal_file(tmp_path)).axes["x"]
    data = regression_data(driven(noise_force(1), 1), axis)
    rigid_n = 5.0 * data.motion.acceleration_m_s2 + 40.0 * data.motion.velocity_m_s
    rigid_n += np.random.default_rng(9).normal(scale=5.0, size=len(rigid_n))
    assert spring_behind_motor.shapes([data._replace(force_n=rigid_n)]) == []


def test_the_written_model_has_both_masses_spring_and_damper_and_reads_back_as_consistent(
    tmp_path: Path,
) -> None:
    files = [written(driven(noise_force(seed), seed), tmp_path / f"{seed}.csv") for seed in (1, 2)]
    first = diagnose(files, nominal_file(tmp_path), tmp_path / "first", with_report=False, with_next=False)
    assert [finding["effect"] for finding in first.verdict["findings"]] == ["drive_compliance"]
    axis = tomllib.loads(first.model_file.read_text(encoding="utf-8"))["axis"]["x"]
    assert axis["drive_compliance"]["stiffness_n_um"] * 1e6 == pytest.approx(STIFFNESS_N_M, rel=0.03)
    assert axis["drive_compliance"]["damping_n_s_m"] == pytest.approx(DAMPING_N_S_M, rel=0.2)
    assert axis["table"]["mass_kg"] == pytest.approx(LOAD_KG, rel=0.02)
    motor_kg = axis["motor"]["inertia_kg_cm2"] * 1e-4 * (2.0 * math.pi / 0.01) ** 2
    assert motor_kg == pytest.approx(MOTOR_KG, rel=0.02)
    again = diagnose(files, first.model_file, tmp_path / "second", with_report=False, with_next=False)
    assert again.verdict["verdict"] == "consistent"
    left, before = (
        again.verdict["fit"]["x"]["force"]["before"],
        first.verdict["fit"]["x"]["force"]["refitted"],
    )
    assert left["heldout"] < 0.05 * before["heldout"]
