"""The replay within a diagnosis: both models under the known controller, and the notes on failure."""

import json
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from kernels.arrays import Array
from reconcile.diagnosis.diagnose import diagnose
from reconcile.errors import ReconcileError
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import AxisRecording
from reconcile.replay.controller import load_controllers
from reconcile.replay.model_replays import (
    REPLAYED_S,
    ControlLoop,
    ModelReplays,
    controller_mismatch,
    replay_models,
    replays_json,
)
from reconcile.replay.replay import plant_of, replay

T, N, NOISE_N = 1e-3, 16_000, 0.2
COGGING: dict[str, Any] = {"harmonic": [2.0], "amplitude_n": [4.0], "phase_deg": [40.0]}
MODEL = """
[axis.x]
transmission.lead_mm = 5.0
motor.torque_constant_nm_a = 0.4
table.mass_kg = 50.0
encoder.counts_per_rev = 1000000
viscous_friction.viscous_n_s_m = 100.0
coulomb_friction.coulomb_n = 12.0
[axis.x.controller]
form = "cascade"
sample_time_ms = 1.0
position_gain_1_s = 40.0
velocity_gain_n_s_m = 5000.0
velocity_integral_n_m = 100000.0
velocity_feedforward = 1.0
velocity_samples = 2
"""


def edited(file: Path, changes: dict[str, dict[str, Any]] | None = None) -> Path:
    """The model file with other values in the axis' sections."""
    document = tomllib.loads(MODEL)
    for section, values in (changes or {}).items():
        document["axis"]["x"][section] = {**document["axis"]["x"].get(section, {}), **values}
    file.write_text(tomli_w.dumps(document), encoding="utf-8")
    return file


def led(
    reference_m: Array, true: Path, source: str = "r", *, injected_n: float = 0.0, origin_m: float = 0.0
) -> AxisRecording:
    """What a plant does under the controller, with noise on its force; pushed now and then, on request."""
    time_s = np.arange(len(reference_m)) * T
    rest = np.zeros_like(time_s)
    given = AxisRecording(source, "x", T, time_s, rest, rest, None, reference_m, None, {})
    pushed_n = injected_n * (np.sin(2.0 * math.pi * 2.0 * time_s) > 0.8)
    run = replay(
        given, plant_of(load_model(true)), load_controllers(true)["x"], injected_n=pushed_n, origin_m=origin_m
    )
    noise_n = np.random.default_rng(1).normal(size=len(time_s)) * NOISE_N
    return given._replace(motor_m=run.replayed_motor_m, force_n=run.replayed_force_n + noise_n)


def sweep(count: int = N) -> Array:
    t = np.arange(count) * T
    gently = np.sin(0.5 * math.pi * np.minimum(t / 0.5, 1.0)) ** 4
    return gently * (0.02 * np.sin(2.0 * math.pi * 0.31 * t) + 0.008 * np.sin(2.0 * math.pi * 1.13 * t))


def both(
    recordings: list[AxisRecording], nominal: Path, timing_s: float = 0.0, *, separate_zeros: bool = False
) -> ModelReplays:
    loop = ControlLoop(load_controllers(nominal)["x"], timing_s, separate_zeros)
    return replay_models(recordings, load_model(nominal), {"x": {"cogging": COGGING}}, {"x": loop})


@pytest.fixture
def nominal(tmp_path: Path) -> Path:
    return edited(tmp_path / "nominal.toml")


@pytest.fixture
def true(tmp_path: Path) -> Path:
    return edited(tmp_path / "true.toml", {"cogging": COGGING})


def test_a_diagnosis_replays_both_models_where_the_controller_is_known(
    tmp_path: Path, nominal: Path, true: Path
) -> None:
    recording = led(sweep(), true)
    columns = (recording.time_s, recording.motor_m, recording.force_n, recording.reference_m)
    header = "time_s,motor_position_m,motor_force_n,position_command_m"
    file, steps = tmp_path / "run.csv", list[str]()
    np.savetxt(file, np.stack(columns, axis=1), delimiter=",", comments="", header=header)  # type: ignore[arg-type]
    found = diagnose([file], nominal, tmp_path / "out", on_progress=steps.append, with_report=False)
    assert "replaying" in steps
    content = json.loads(found.verdict_file.read_text(encoding="utf-8"))
    assert content["verdict"] == "effects"
    assert "next_experiment" in content
    [comparison] = content["fit"]["x"]["replay"]
    assert comparison["recording"] == str(file)
    recorded_n = float(np.sqrt(np.mean(recording.force_n**2)))
    assert (
        comparison["force_error"]["before"] > 0.7 * 4.0 / math.sqrt(2.0) / recorded_n
    )  # the ripple is missing
    assert comparison["force_error"]["after"] < 2.0 * NOISE_N / recorded_n
    assert comparison["motor_rms_m"]["after"] < 0.2 * comparison["motor_rms_m"]["before"]


def test_the_first_two_recordings_are_replayed_for_thirty_seconds(nominal: Path, true: Path) -> None:
    long = led(sweep(round(1.2 * REPLAYED_S / T)), true, "a")
    short = [led(sweep(3000), true, source) for source in "bc"]
    unled = short[0]._replace(reference_m=None)
    found = both([unled, long, *short], nominal)
    assert [one.nominal.source for one in found.comparisons] == ["a", "b"]
    assert found.comparisons[0].repaired.time_s[-1] == pytest.approx(REPLAYED_S)
    assert found.notes == []
    assert [entry["recording"] for entry in replays_json(found.comparisons, "x")] == ["a", "b"]
    assert replays_json(found.comparisons, "y") == []


def test_the_timing_that_was_found_is_in_the_repaired_loop_alone(nominal: Path, true: Path) -> None:
    recording = led(sweep(3000), true)
    [prompt], [late] = both([recording], nominal).comparisons, both([recording], nominal, 2.5 * T).comparisons
    assert (late.nominal.replayed_force_n == prompt.nominal.replayed_force_n).all()
    assert late.repaired.error().force_rms_n > prompt.repaired.error().force_rms_n


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"controller": {"velocity_gain_n_s_m": 2e6}}, "model is unstable"),
        ({"controller": {"sample_time_ms": 0.73}}, "not a whole number of plant.substep_us"),
        ({"table": {"mass_kg": -1.0}}, "table.mass_kg"),
    ],
)
def test_a_replay_that_fails_is_a_note(
    tmp_path: Path, true: Path, changes: dict[str, dict[str, Any]], reason: str
) -> None:
    found = both([led(sweep(3000), true)], edited(tmp_path / "other.toml", changes))
    assert found.comparisons == []
    [note] = found.notes
    assert note.startswith("closed-loop replay: ")
    assert reason in note


def test_a_force_added_to_the_controller_output_is_reported(nominal: Path, true: Path) -> None:
    pushed = led(sweep(6000), true, injected_n=40.0)
    found = both([pushed], nominal)
    assert len(found.comparisons) == 1
    assert "a force acted beside it" in found.notes[0]
    same = load_controllers(nominal)["x"]
    softer = same._replace(
        velocity_gain_n_s_m=0.8 * same.velocity_gain_n_s_m,
        velocity_integral_n_m=0.8 * same.velocity_integral_n_m,
    )
    clean = led(sweep(6000), true)
    assert controller_mismatch(clean, same) == pytest.approx(0.0, abs=0.01)  # the noise behind the filter
    assert controller_mismatch(clean, softer) == pytest.approx(0.2, abs=0.01)  # the law is linear in both
    assert (
        controller_mismatch(clean, same._replace(sample_time_s=0.5 * T)) is None
    )  # finer than what was recorded


def test_a_recording_with_a_zero_of_its_own_gets_the_shift_that_fits(nominal: Path, true: Path) -> None:
    recordings = [led(sweep(6000), true, "a"), led(sweep(6000), true, "b", origin_m=0.7e-3)]
    first, second = both(recordings, nominal, separate_zeros=True).comparisons
    assert first.repaired.origin_m == 0.0
    assert second.nominal.origin_m == 0.0  # without a ripple there is no zero
    assert second.repaired.origin_m % 2.5e-3 == pytest.approx(0.7e-3, abs=2e-5)  # twice a turn of 5 mm
    assert (
        both(recordings, nominal, separate_zeros=True)
        .notes[0]
        .startswith("closed-loop replay: b: axis x: its zero")
    )
    kept = both(recordings, nominal).comparisons[1]
    assert kept.repaired.error().force_rms_n > 3.0 * second.repaired.error().force_rms_n


def test_an_axis_without_a_reference_is_refused_with_advice(nominal: Path, true: Path) -> None:
    found = both([led(sweep(3000), true)._replace(reference_m=None)], nominal)
    assert found.comparisons == []
    assert "--map reference=" in found.notes[0]


def test_without_a_controller_there_is_no_replay_and_no_note(true: Path) -> None:
    assert replay_models([led(sweep(3000), true)], load_model(true), {}, {}) == ([], [])


def test_an_unusable_controller_is_refused_before_the_diagnosis(tmp_path: Path) -> None:
    file = edited(tmp_path / "bad.toml", {"controller": {"form": "fuzzy"}})
    with pytest.raises(ReconcileError, match=r"axis\.x\.controller\.form"):
        diagnose([tmp_path / "absent.csv"], file, tmp_path / "out")
