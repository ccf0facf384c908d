"""Files with gaps, uneven sampling, missing values, jumps and spikes become even pieces, with notes."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from axis_motion import COUNT_M, Axis, clean, counted, motion

from reconcile.errors import ReconcileError
from reconcile.formats.mapping import parse_mapping
from reconcile.recording.recording import AxisRecording, load_recordings
from reconcile.sensing.channel import quantum
from reconcile.sensing.checks import examine

MODEL = {"x": Axis()}
CLEAN = clean(4.0)
SCALE_M = CLEAN.scale_m if CLEAN.scale_m is not None else np.zeros(0)
EMPS = Path(__file__).parents[4].parent / "shared" / "data" / "emps"
COLUMNS = {
    "time_s": CLEAN.time_s,
    "x.motor_position_m": CLEAN.motor_m,
    "x.motor_force_n": CLEAN.force_n,
    "x.scale_position_m": SCALE_M,
}


def load(directory: Path, columns: dict[str, np.ndarray]) -> list[AxisRecording]:
    pq.write_table(pa.table(columns), directory / "r.parquet")
    return load_recordings([directory / "r.parquet"], MODEL)


def without(rows: slice) -> dict[str, np.ndarray]:
    return {name: np.delete(values, rows) for name, values in COLUMNS.items()}


def changed(name: str, rows: object, value: object) -> dict[str, np.ndarray]:
    values = COLUMNS[name].copy()
    values[rows] = value
    return {**COLUMNS, name: values}


def test_a_few_missing_rows_are_interpolated_and_reported(tmp_path: Path) -> None:
    (recording,) = load(tmp_path, without(slice(1500, 1503)))
    np.testing.assert_allclose(recording.motor_m, CLEAN.motor_m, atol=3e-7)
    assert len(recording.force_n) == 4000
    (finding,) = recording.findings
    assert (finding.check, finding.severity, finding.size) == ("gap", "note", 3.0)
    assert finding.start_s == pytest.approx(1.499)


def test_a_long_gap_splits_the_recording(tmp_path: Path) -> None:
    first, second = load(tmp_path, without(slice(1500, 1900)))
    np.testing.assert_array_equal(first.motor_m, CLEAN.motor_m[:1500])
    np.testing.assert_array_equal(second.motor_m, CLEAN.motor_m[1900:])
    assert second.start_s == pytest.approx(1.9)
    assert second.time_s[0] == 0.0
    assert "[1.900 to 3.999 s]" in second.source
    assert [(f.check, f.severity, f.size) for f in second.findings] == [("gap", "warning", 400.0)]


def test_long_gaps_in_values_split_the_recording_and_trim_its_ends(tmp_path: Path) -> None:
    columns = changed("x.motor_force_n", np.r_[0:100, 2000:2300, 3900:4000], np.nan)
    first, second = load(tmp_path, columns)
    assert (first.start_s, len(first.force_n)) == (pytest.approx(0.1), 1900)
    assert (second.start_s, len(second.force_n)) == (pytest.approx(2.3), 1600)


def test_stretches_too_short_for_a_diagnosis_are_left_out_and_reported(tmp_path: Path) -> None:
    columns = changed("x.motor_force_n", np.r_[0:300, 700:1000, 1100:1300], np.nan)
    (recording,) = load(tmp_path, columns)
    assert recording.start_s == pytest.approx(1.3)
    [short] = [finding for finding in recording.findings if finding.check == "short"]
    assert short.severity == "warning"
    assert short.size == pytest.approx(0.498)
    assert "2 stretches between gaps" in short.message


def test_a_recording_of_a_third_of_a_second_is_taken_and_one_shorter_is_refused(tmp_path: Path) -> None:
    (recording,) = load(tmp_path, {name: values[1000:1370] for name, values in COLUMNS.items()})
    assert len(recording.force_n) == 370
    with pytest.raises(ReconcileError, match=r"0\.25 s and 200 samples; the longest is 0\.219 s"):
        load(tmp_path, {name: values[1000:1220] for name, values in COLUMNS.items()})


def test_a_scale_with_hardly_a_value_is_taken_as_not_recorded(tmp_path: Path) -> None:
    (recording,) = load(tmp_path, changed("x.scale_position_m", slice(1, None), np.nan))
    assert len(recording.motor_m) == 4000
    assert recording.scale_m is None


def test_an_encoder_rezeroed_during_the_run_splits_the_recording(tmp_path: Path) -> None:
    jump_m = -0.0123
    columns = changed("x.motor_position_m", slice(2500, None), CLEAN.motor_m[2500:] + jump_m)
    first, second = load(tmp_path, columns)
    assert len(first.motor_m) == 2500
    finding = second.findings[0]
    assert (finding.check, finding.channel) == ("jump", "motor_m")
    assert finding.size == pytest.approx(jump_m, abs=1e-4)
    assert finding.end_s == pytest.approx(2.5)
    assert "re-zeroed" in finding.message


def test_a_jump_by_a_power_of_two_of_the_counts_is_called_a_wrap(tmp_path: Path) -> None:
    columns = changed("x.motor_position_m", slice(2500, None), CLEAN.motor_m[2500:] + 2**24 * COUNT_M)
    assert "24 bits that wraps" in load(tmp_path, columns)[0].findings[0].message


def test_single_outliers_are_interpolated_and_reported(tmp_path: Path) -> None:
    rows = [700, 1800, 3000]
    columns = changed("x.scale_position_m", rows, SCALE_M[rows] + [1e-3, -2e-3, 0.5])
    (recording,) = load(tmp_path, columns)
    assert recording.scale_m is not None
    np.testing.assert_allclose(recording.scale_m, SCALE_M, atol=5e-7)
    spikes = [f for f in recording.findings if f.check == "spike"]
    assert [f.start_s for f in spikes] == pytest.approx([0.7, 1.8, 3.0])
    assert [f.size for f in spikes] == pytest.approx([1e-3, -2e-3, 0.5], abs=1e-4)


def test_samples_at_uneven_instants_are_resampled(tmp_path: Path) -> None:
    # 5 % of a sample time, at 0.15 m/s: 8 um, which no later stage could tell from physics
    rng = np.random.default_rng(4)
    time_s = CLEAN.time_s + rng.normal(0.0, 5e-5, len(CLEAN.time_s))
    moved = motion(time_s)
    position_m = np.interp(time_s, CLEAN.time_s, motion(CLEAN.time_s).position_m)
    columns = COLUMNS | {"time_s": time_s, "x.motor_position_m": counted(position_m, COUNT_M)}
    columns |= {"x.scale_position_m": counted(position_m, COUNT_M), "x.motor_force_n": moved.force_n}
    (recording,) = load(tmp_path, columns)
    (finding,) = recording.findings
    assert (finding.check, "resampled" in finding.message) == ("jitter", True)
    assert finding.size == pytest.approx(5.0, rel=0.1)
    true_m = np.interp(recording.start_s + recording.time_s, CLEAN.time_s, motion(CLEAN.time_s).position_m)
    inner = slice(10, -10)
    assert np.std(recording.motor_m[inner] - true_m[inner]) < 2e-7


def test_an_even_clock_that_runs_fast_keeps_its_samples(tmp_path: Path) -> None:
    (recording,) = load(tmp_path, COLUMNS | {"time_s": 100.0 + CLEAN.time_s * 1.0001})
    np.testing.assert_array_equal(recording.motor_m, CLEAN.motor_m)
    assert recording.period_s == pytest.approx(1.0001e-3, rel=1e-9)
    assert recording.findings == ()


@pytest.mark.parametrize(
    ("time_s", "reason"),
    [
        (np.sort(np.random.default_rng(5).uniform(0.0, 4.0, 4000)), r"the samples are uneven: .* ms apart"),
        (np.where(np.arange(4000) == 777, np.nan, CLEAN.time_s), r"time, row 777: is missing"),
        (np.where(np.arange(4000) == 777, 0.5, CLEAN.time_s), r"time, row 777: does not increase"),
        (CLEAN.time_s * 1e6, r"sample time is 1000 s"),
    ],
)
def test_time_that_cannot_be_used_is_refused_with_its_row(
    time_s: np.ndarray, reason: str, tmp_path: Path
) -> None:
    with pytest.raises(ReconcileError, match=reason):
        load(tmp_path, COLUMNS | {"time_s": time_s})


def test_a_position_of_the_wrong_type_is_refused(tmp_path: Path) -> None:
    low_word_m = np.mod(np.rint(CLEAN.motor_m / COUNT_M), 2**14) * COUNT_M
    with pytest.raises(ReconcileError, match=r"axis x, motor_m, .* s: jumps \d+ times.*counter that wraps"):
        load(tmp_path, COLUMNS | {"x.motor_position_m": low_word_m})


def test_an_axis_that_the_model_does_not_have_is_refused_by_name(tmp_path: Path) -> None:
    pq.write_table(pa.table(COLUMNS), tmp_path / "r.parquet")
    with pytest.raises(ReconcileError, match=r"none of the model's axes \(y, z\); it has x"):
        load_recordings([tmp_path / "r.parquet"], {"y": Axis(), "z": Axis()})


@pytest.mark.skipif(not EMPS.is_dir(), reason="the EMPS data are not here")
def test_the_emps_axis_loads_by_a_mapping_and_its_treated_record_is_noticed() -> None:
    model = {"x": Axis(lead_m=2.5e-3, force_constant_n_a=35.15, mass_kg=95.1, encoder_resolution_m=5e-8)}
    tidy = parse_mapping(["position=q_meas_m,force=force_N,time=t_s,reference=q_ref_m"])
    original = parse_mapping(["position=qm,voltage=vir,force_per_volt=gtau,reference=qg"])
    recordings = load_recordings([EMPS / "emps_train.npz", EMPS / "emps_test_pulses.npz"], model, tidy)
    (matlab,) = load_recordings([EMPS / "orig" / "DATA_EMPS.mat"], model, original)
    for recording in recordings:
        assert len(recording.time_s) == 24841
        assert recording.period_s == pytest.approx(1e-3, rel=1e-9)
    np.testing.assert_allclose(matlab.force_n, recordings[0].force_n, rtol=1e-12)
    np.testing.assert_array_equal(matlab.motor_m, recordings[0].motor_m)
    report = examine(recordings, model)
    assert {(f.check, f.channel, Path(f.source).name) for f in report.findings} == {
        ("resolution", "motor_m", "emps_test_pulses.npz"),
        ("filter", "motor_m", "emps_test_pulses.npz"),
    }
    assert quantum(report.recordings[0].motor_m) == pytest.approx(5e-8, rel=1e-6)
