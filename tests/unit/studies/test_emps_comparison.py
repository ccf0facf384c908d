"""EMPS: the comparison itself, on numbers made by hand."""

from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.recording.reader import Recording
from studies.emps.comparison import EmpsError, compare, load_measurement, record_path, relative_error_percent

COUNT, GTAU_N_V = 50, 35.0


def measurement(tmp_path: Path) -> Path:
    path = tmp_path / "emps_train.npz"
    time_s = np.arange(COUNT) * 1e-3
    np.savez(
        path,
        t_s=time_s,
        q_meas_m=time_s,
        force_N=np.full(COUNT, 100.0),
        pulse_V=np.full(COUNT, 1.0),
        gtau_N_per_V=GTAU_N_V,
    )
    return path


def recording(rows: int, force_n: float) -> Recording:
    idle = 3
    columns = {
        "segment": np.array([-1] * idle + [0] * rows, dtype=np.int32),
        "x.force_command_n": np.concatenate((np.zeros(idle), np.full(rows, force_n))),
        "x.motor_position_m": np.concatenate((np.zeros(idle), np.arange(rows) * 1e-3)),
    }
    return Recording(Path("made by hand"), {"axes": ["x"], "segments": []}, columns)


def test_relative_error_is_the_ratio_of_the_norms() -> None:
    assert relative_error_percent(np.array([3.0, 4.0]), np.array([0.0, 4.0])) == pytest.approx(75.0)


def test_pulses_are_added_behind_the_controllers_force(tmp_path: Path) -> None:
    result = compare(recording(COUNT, 60.0), load_measurement(measurement(tmp_path)))
    # 60 N + 1 V * 35 N/V = 95 N against 100 N
    assert result.force_error_percent == pytest.approx(5.0)
    assert result.position_rms_um == pytest.approx(0.0)


def test_a_run_that_was_cut_short_is_refused(tmp_path: Path) -> None:
    with pytest.raises(EmpsError, match="49 samples of 50"):
        compare(recording(COUNT - 1, 60.0), load_measurement(measurement(tmp_path)))


def test_absent_or_foreign_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(EmpsError, match=r"has no emps_train\.npz"):
        record_path(tmp_path, "train")
    foreign = tmp_path / "emps_train.npz"
    np.savez(foreign, other=np.zeros(3))
    with pytest.raises(EmpsError, match="not an EMPS record"):
        load_measurement(record_path(tmp_path, "train"))
