"""The proof is what the written file does on recordings that took no part; the laws are written out here."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nominal_model_text import WITH_SCALE, WITHOUT_SCALE

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.diagnosis.diagnose import diagnose

T, N, LEAD_M = 1e-3, 14_000, 5e-3
NOISE_N = 0.3
Law = Any


def recorded(folder: Path, number: int, force_beside: Law) -> Path:
    """A motion of its own of a rigid axis of 50 kg, 100 N s/m and 12 N, and a force beside."""
    rng, t = np.random.default_rng(number), np.arange(N) * T
    x = 0.02 * np.sin(2.0 * math.pi * (0.31 + 0.07 * number) * t) + 0.008 * np.sin(7.1 * t + number)
    v, a = np.gradient(x, T), np.gradient(np.gradient(x, T), T)
    force = 50.0 * a + 100.0 * v + 12.0 * np.sign(v) + force_beside(t, x, v) + rng.normal(size=N) * NOISE_N
    columns = np.stack((t, np.round(x / 5e-9) * 5e-9, force), axis=1)
    file = folder / f"r{number}.csv"
    np.savetxt(file, columns, delimiter=",", comments="", header="time_s,motor_position_m,motor_force_n")
    return file


def diagnosed(folder: Path, force_beside: Law, recordings: int) -> dict[str, Any]:
    (folder / "nominal.toml").write_text(WITHOUT_SCALE, encoding="utf-8")
    files = [recorded(folder, number, force_beside) for number in range(recordings)]
    found = diagnose(files, folder / "nominal.toml", folder / "out", with_report=False, with_next=False)
    return found.verdict


def ripple(_t: Array, x: Array, _v: Array) -> Array:
    return np.asarray(2.0 * np.sin(2.0 * math.pi / LEAD_M * x))


@pytest.mark.parametrize("recordings", [1, 3])
def test_what_a_written_ripple_leaves_of_what_was_left_out_is_noise(tmp_path: Path, recordings: int) -> None:
    verdict = diagnosed(tmp_path, ripple, recordings)
    assert [f["effect"] for f in verdict["findings"]] == ["cogging"]
    [proof] = verdict["proof"]["x"]
    assert proof["left_out"] == ("the last third" if recordings == 1 else "each recording in turn")
    assert len(proof["parts"]) == recordings
    assert (proof["improves"], proof["dropped"]) == (True, [])
    # the ripple alone is 1.4 N RMS; behind the filter of 60 Hz the noise of 0.3 N is a third of that
    assert proof["rigid"] == pytest.approx(math.sqrt(2.0), rel=0.15)
    assert proof["written"] < 0.2
    parts = verdict["accounted"]["x"]["force"]["parts"]
    assert parts["cogging"]["rms"] == pytest.approx(math.sqrt(2.0), rel=0.15)
    assert parts["unexplained"]["rms"] < 0.1
    assert verdict["accounted"]["x"]["force"]["is_noise"]


def test_a_force_that_differs_in_each_recording_has_no_name_and_is_in_no_model(tmp_path: Path) -> None:
    def wander(t: Array, x: Array, _v: Array) -> Array:
        rng = np.random.default_rng(int(1e6 * abs(x[500])))
        knots = rng.normal(size=15) * 4.0
        return np.asarray(np.interp(t, np.linspace(0.0, t[-1], 15), knots))

    verdict = diagnosed(tmp_path, wander, 3)
    assert verdict["verdict"] == "unknown"
    assert {f["effect"] for f in verdict["findings"]} == {"unknown"}
    [proof] = verdict["proof"]["x"]
    assert proof["written"] <= 1.02 * proof["rigid"]


def test_textbook_friction_that_is_written_is_no_finding(tmp_path: Path) -> None:
    """A drift that no plant has, damping that grows with the position, and a pull below both."""

    def foreign(t: Array, x: Array, v: Array) -> Array:
        knots = np.random.default_rng(4).normal(size=30)
        drift = 3.0 * np.interp(t, np.linspace(0.0, t[-1], 30), knots)
        return np.asarray(1500.0 * x * np.abs(v) + drift + 2.0)

    verdict = diagnosed(tmp_path, foreign, 1)
    [proof] = verdict["proof"]["x"]
    assert proof["written_model"] == "beside textbook friction"
    assert any("none of them a finding" in note for note in verdict["notes"])
    named = {f["effect"] for f in verdict["findings"]}
    assert not named & {"constant_force", "asymmetric_viscous_friction", "stribeck_friction"}


def test_a_rigid_axis_with_right_values_is_consistent(tmp_path: Path) -> None:
    verdict = diagnosed(tmp_path, lambda t, _x, _v: np.zeros(len(t)), 2)
    assert (verdict["verdict"], verdict["findings"]) == ("consistent", [])
    assert verdict["accounted"]["x"]["force"]["is_noise"]


def test_a_screw_that_warms_is_written_and_proven(tmp_path: Path) -> None:
    rng, period_s = np.random.default_rng(5), 2.0 * T
    t = np.arange(N) * period_s
    x = 0.02 * np.sin(2.0 * math.pi * 0.31 * t) + 0.008 * np.sin(7.1 * t)
    v, a = np.gradient(x, period_s), np.gradient(np.gradient(x, period_s), period_s)
    force = 50.0 * a + 100.0 * v + 12.0 * np.sign(v) + rng.normal(size=N) * NOISE_N
    scale = x + 4e-4 * (x + 0.1) * (1.0 - np.exp(-t / 10.0))
    columns = np.stack((t, np.round(x / 5e-9) * 5e-9, force, np.round(scale / 5e-9) * 5e-9), axis=1)
    header = "time_s,motor_position_m,motor_force_n,scale_position_m"
    np.savetxt(tmp_path / "warm.csv", columns, delimiter=",", comments="", header=header)
    model, out = tmp_path / "nominal.toml", tmp_path / "out"
    model.write_text(WITH_SCALE, encoding="utf-8")
    verdict = diagnose([tmp_path / "warm.csv"], model, out, with_report=False, with_next=False).verdict
    assert "thermal_expansion" in {f["effect"] for f in verdict["findings"]}
    deviation = ResidualChannel.POSITION_DEVIATION.value
    [proof] = (one for one in verdict["proof"]["x"] if one["channel"] == deviation)
    assert proof["improves"]
