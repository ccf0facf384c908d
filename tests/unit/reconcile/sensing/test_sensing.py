"""Defects added to clean recordings are found, with place and size; clean ones have none."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from axis_motion import SCALE_COUNT_M, STIFFNESS_N_M, Axis, clean, counted, held, motion
from scipy.signal import butter, lfilter, sosfilt

from kernels.arrays import Array
from reconcile.errors import ReconcileError
from reconcile.recording.recording import AxisRecording
from reconcile.recording.sensor_finding import SensorFinding
from reconcile.sensing.channel import noise, quantum
from reconcile.sensing.checks import examine
from reconcile.sensing.judgement import Judge

MODEL = {"x": Axis()}
CLEAN = clean()
SCALE_M = CLEAN.scale_m if CLEAN.scale_m is not None else np.zeros(0)


def found(recording: AxisRecording) -> dict[tuple[str, str], SensorFinding]:
    return {(finding.check, finding.channel): finding for finding in examine([recording], MODEL).findings}


def play(values: Array, width: float) -> Array:
    out = np.zeros_like(values)
    for i in range(1, len(values)):
        out[i] = min(max(out[i - 1], values[i] - width / 2), values[i] + width / 2)
    return out


@pytest.mark.parametrize("seed", range(4))
def test_clean_recordings_have_no_finding(seed: int) -> None:
    report = examine([clean(seed=seed), clean(seed=seed + 10, source="second")], MODEL)
    assert report.findings == []
    assert len(report.recordings) == 2


def test_steps_and_noise_of_each_channel_are_measured() -> None:
    step_m = quantum(CLEAN.motor_m)
    assert step_m == pytest.approx(5e-8, rel=1e-6)
    assert quantum(SCALE_M) == pytest.approx(1e-7, rel=1e-6)
    assert quantum(CLEAN.force_n) == 0.0
    assert noise(CLEAN.force_n, 0.0) == pytest.approx(0.3, rel=0.1)
    assert noise(CLEAN.motor_m, step_m) == pytest.approx(np.hypot(2e-8, 5e-8 / np.sqrt(12)), rel=0.2)


def test_even_distances_of_a_constant_speed_are_no_count() -> None:
    """The velocity step of a soft table: 40 um a sample, with one distance of half of it at the start."""
    step_m = 40e-6 * np.minimum(np.maximum(np.arange(400.0) - 100.0, 0.0), 1e9)
    swinging_m = 6e-6 * np.sin(0.05 * np.arange(400)) * np.exp(-np.arange(400) / 120.0) * (step_m > 0.0)
    position_m = counted(step_m + swinging_m - 20e-6 * (step_m > 0.0), 1e-8)
    assert quantum(position_m) == 0.0


@pytest.mark.parametrize("rounded_to_m", [1e-12, 1e-9])
def test_a_count_is_found_through_the_digits_of_a_file_over_a_long_travel(rounded_to_m: float) -> None:
    position_m = counted(5e-3 * np.sin(np.linspace(0.0, 20.0, 60_000)), 4.7683716e-8)
    assert quantum(counted(position_m, rounded_to_m)) == pytest.approx(4.7683716e-8, rel=1e-3)


def test_fast_motion_on_the_count_of_the_model_file_has_no_finding_of_its_resolution() -> None:
    time_s = np.arange(400) * 1e-3
    fast_m = 0.01 * np.sin(2.0 * np.pi * 2.5 * time_s + 0.3 * np.sin(9.0 * time_s))
    fast = clean(0.4)._replace(motor_m=counted(fast_m, 5e-8), scale_m=None, reference_m=None)
    judged = {f.check for f in Judge(fast, Axis()).resolution("motor_m", fast.motor_m, quantum(fast.motor_m))}
    assert judged == set()
    smooth = fast._replace(motor_m=fast_m)
    judged = {f.check for f in Judge(smooth, Axis()).resolution("motor_m", fast_m, quantum(fast_m))}
    assert judged == {"resolution"}


@pytest.mark.parametrize("samples", [2.0, 3.0, 4.0, 10.0 / 3.0])
@pytest.mark.parametrize("channel", ["motor_m", "scale_m", "force_n"])
def test_a_slower_channel_is_found_with_its_own_rate(channel: str, samples: float) -> None:
    slow = CLEAN._replace(**{channel: held(getattr(CLEAN, channel), samples)})
    findings = found(slow)
    assert findings["hold", channel].size == pytest.approx(samples, rel=0.05)
    assert {name for check, name in findings if check == "hold"} == {channel}


@pytest.mark.parametrize("late_s", [3e-4, 1e-3, 4.6e-3, 2e-2, -1.5e-3])
def test_a_late_scale_is_found_to_a_fraction_of_a_sample_and_is_no_other_unit(late_s: float) -> None:
    moved = motion(CLEAN.time_s)
    delayed_m = np.interp(CLEAN.time_s - late_s, CLEAN.time_s, moved.position_m)
    findings = found(
        CLEAN._replace(scale_m=counted(delayed_m - moved.force_n / STIFFNESS_N_M, SCALE_COUNT_M))
    )
    assert set(findings) == {("delay", "scale_m")}
    assert findings["delay", "scale_m"].size == pytest.approx(late_s, abs=2e-5)


@pytest.mark.parametrize("stiffness_n_m", [np.inf, 20e6])
@pytest.mark.parametrize("width_m", [0.0, 20e-6])
def test_backlash_and_compliance_are_not_taken_for_a_delay(width_m: float, stiffness_n_m: float) -> None:
    table_m = play(CLEAN.motor_m, width_m) - motion(CLEAN.time_s).force_n / stiffness_n_m
    assert found(CLEAN._replace(scale_m=counted(table_m, SCALE_COUNT_M))) == {}


def test_a_soft_drive_train_that_yields_slowly_is_not_taken_for_a_delay() -> None:
    stiffness_n_m, relaxation_s = 0.4e6, 0.037
    yielding = np.exp(-1e-3 / relaxation_s)
    deflection_m = lfilter([1.0 - yielding], [1.0, -yielding], motion(CLEAN.time_s).force_n / stiffness_n_m)
    assert found(CLEAN._replace(scale_m=counted(CLEAN.motor_m - deflection_m, SCALE_COUNT_M))) == {}


def test_a_lead_error_of_the_catalogue_is_no_wrong_unit_but_another_lead_is_refused() -> None:
    assert found(CLEAN._replace(scale_m=counted(1.0003 * SCALE_M, SCALE_COUNT_M))) == {}
    with pytest.raises(ReconcileError, match=r"clean: axis x, scale_m: moves by 2 m per metre.*lead"):
        found(CLEAN._replace(scale_m=2.0 * SCALE_M))


def test_a_force_that_follows_its_command_late_is_found() -> None:
    findings = found(CLEAN._replace(force_n=np.roll(CLEAN.force_n, 7)))
    assert set(findings) == {("delay", "force_n")}
    assert findings["delay", "force_n"].size == pytest.approx(7e-3, abs=1e-4)


def test_another_force_constant_shows_against_the_command() -> None:
    assert found(CLEAN._replace(force_n=0.7 * CLEAN.force_n))["gain", "force_n"].size == pytest.approx(
        0.7, rel=0.01
    )


def test_a_clipped_force_is_found_with_its_levels_and_first_time() -> None:
    report = examine([CLEAN._replace(force_n=np.clip(CLEAN.force_n, -45.0, 50.0))], MODEL)
    clipped = [finding for finding in report.findings if finding.check == "clipped"]
    assert {finding.check for finding in report.findings} == {"clipped"}
    for finding, beyond, level in zip(
        clipped, (CLEAN.force_n >= 50.0, CLEAN.force_n <= -45.0), ("50 N", "-45 N"), strict=True
    ):
        assert finding.size == np.count_nonzero(beyond)
        assert finding.start_s == pytest.approx(CLEAN.time_s[np.argmax(beyond)])
        assert f" {level}," in finding.message


def test_a_position_that_stops_abruptly_at_an_extreme_is_clipped_and_one_at_rest_there_is_not() -> None:
    limit_m = 0.012
    findings = found(CLEAN._replace(scale_m=np.minimum(SCALE_M, limit_m)))
    assert findings["clipped", "scale_m"].size == np.count_nonzero(limit_m <= SCALE_M)
    standing_still = np.where(CLEAN.time_s < 4.0, CLEAN.motor_m, CLEAN.motor_m[4000])
    assert ("clipped", "motor_m") not in found(
        CLEAN._replace(motor_m=standing_still, scale_m=None, reference_m=None)
    )


def test_a_command_that_rests_but_for_rounding_is_neither_reversed_nor_in_another_unit() -> None:
    findings = found(CLEAN._replace(reference_m=0.1 - 1e-12 * CLEAN.motor_m))
    assert not {kind for kind, channel in findings if channel == "reference_m"} & {"sign", "unit"}


def test_a_sensor_that_froze_for_a_while_is_found_with_that_time() -> None:
    stuck_m = SCALE_M.copy()
    stuck_m[4000:4200] = stuck_m[4000]
    finding = found(CLEAN._replace(scale_m=stuck_m))["frozen", "scale_m"]
    assert (finding.start_s, finding.end_s) == (pytest.approx(4.0), pytest.approx(4.199))
    assert finding.size == pytest.approx(np.ptp(CLEAN.motor_m[4000:4200]))


def test_a_resolution_coarser_than_in_the_model_is_found() -> None:
    findings = found(CLEAN._replace(motor_m=counted(CLEAN.motor_m, 2e-6)))
    assert set(findings) == {("resolution", "motor_m")}
    assert findings["resolution", "motor_m"].size == pytest.approx(2e-6, rel=1e-3)


def test_a_smoothed_encoder_is_found_by_its_missing_grid_and_its_missing_noise() -> None:
    low_pass = butter(2, 60.0, fs=1000.0, output="sos")
    findings = found(CLEAN._replace(motor_m=sosfilt(low_pass, CLEAN.motor_m), scale_m=None))
    assert set(findings) == {("resolution", "motor_m"), ("filter", "motor_m")}
    assert 50.0 < findings["filter", "motor_m"].size < 150.0


def test_a_filtered_force_shows_against_its_command() -> None:
    corner_hz = 60.0
    rng = np.random.default_rng(1)
    command_n = CLEAN.force_n + rng.normal(0.0, 3.0, len(CLEAN.force_n))
    filtered_n = sosfilt(butter(2, corner_hz, fs=1000.0, output="sos"), command_n)
    findings = examine([CLEAN._replace(force_command_n=command_n, force_n=filtered_n)], MODEL).findings
    against = [f for f in findings if f.check == "filter" and "force_command_n" in f.message]
    assert len(against) == 1
    assert against[0].size == pytest.approx(corner_hz, rel=0.15)


def test_a_rezeroed_encoder_is_found_with_its_shift_within_a_turn() -> None:
    second = clean(seed=3, source="second")
    report = examine([CLEAN, second._replace(motor_m=second.motor_m + 0.0123)], MODEL)
    assert [(f.check, f.source, f.channel) for f in report.findings] == [("origin", "second", "motor_m")]
    assert report.findings[0].size == pytest.approx(0.0123, abs=1e-6)
    assert "(+2.3000 mm within a turn)" in report.findings[0].message


def test_a_frozen_scale_is_left_out_of_the_diagnosis() -> None:
    report = examine([CLEAN._replace(scale_m=np.full_like(SCALE_M, 0.5))], MODEL)
    assert [(f.check, f.channel) for f in report.findings] == [("constant", "scale_m")]
    assert report.recordings[0].scale_m is None


Change = "Callable[[AxisRecording], AxisRecording]"
REFUSED: list[tuple[str, Change, str]] = [
    ("force_n", lambda r: r._replace(force_n=-r.force_n), r"points against.*\*-1"),
    ("scale_m", lambda r: r._replace(scale_m=-SCALE_M), r"the other way.*\*-1"),
    ("force_n", lambda r: r._replace(force_n=r.force_n * 1e-3), r"0\.0[56]\d* kg.*kN"),
    ("force_n", lambda r: r._replace(force_n=r.force_n / 270.0), r"current in A"),
    ("force_n", lambda r: r._replace(force_n=r.force_n * 0.01 / 6.2832), r"torque in N m"),
    ("force_n", lambda r: r._replace(motor_m=r.motor_m * 1e3, scale_m=None, reference_m=None), r"in mm"),
    ("motor_m", lambda r: r._replace(motor_m=0.0 * r.motor_m), r"no motion"),
    ("motor_m", lambda r: r._replace(motor_m=np.resize([0.02, -0.02], len(r.time_s))), r"jitters.*oscillat"),
    ("force_n", lambda r: r._replace(force_n=0.0 * r.force_n + 1.0), r"1 N throughout"),
]


@pytest.mark.parametrize(("channel", "change", "reason"), REFUSED, ids=[reason for _, _, reason in REFUSED])
def test_unusable_data_are_refused_with_what_is_wrong_and_where(
    channel: str, change: Callable[[AxisRecording], AxisRecording], reason: str
) -> None:
    changed = change(CLEAN)._replace(force_command_n=None)
    with pytest.raises(ReconcileError, match=rf"clean: axis x, {channel}: .*{reason}") as refused:
        examine([changed], MODEL)
    assert re.search(reason, str(refused.value))


def test_a_payload_is_not_refused_as_a_wrong_unit() -> None:
    light = {"x": Axis(mass_kg=30.0)}
    assert examine([CLEAN], light).findings == []


def test_a_recording_at_100_hertz_reports_what_it_cannot_show() -> None:
    every = slice(None, None, 10)
    slow = CLEAN._replace(
        period_s=1e-2,
        time_s=CLEAN.time_s[every],
        motor_m=CLEAN.motor_m[every],
        force_n=CLEAN.force_n[every],
        scale_m=None,
        reference_m=None,
        force_command_n=None,
    )
    note = found(slow)["rate", ""]
    assert note.severity == "note"
    assert "nothing above 50 Hz is in them, and only what is below 6 Hz is explained" in note.message
