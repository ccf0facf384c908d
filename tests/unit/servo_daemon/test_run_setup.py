"""The header of a recording: enough to write a report without the machine file."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from fake_command_handler import SCREW, FakeCommandHandler
from run_report_example import REPORT

from servo_ctrl.commands.learned_status import WaveformStatus
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.run.run_recording import RunRecording

XY_TABLE = Path(__file__).parents[3] / "machines" / "xy_table"


def test_a_recording_lists_nodes_limits_and_active_compensation(tmp_path: Path) -> None:
    handler = FakeCommandHandler()
    recording = RunRecording(
        tmp_path / "r", load_machine(XY_TABLE), (), handler, program=None, pacing="lockstep"
    )
    in_use = handler.now.axes[0]._replace(version=3, learned_at="2026-11-20T09:00:00+00:00", screw=SCREW)
    in_use = in_use._replace(waveform=WaveformStatus(enabled=True, version=4))
    handler.now = handler.now._replace(
        axes=(in_use, *handler.now.axes[1:]), settings=handler.now.settings._replace(required_m=3e-6)
    )
    report = replace(REPORT, reason="stopped by SIGTERM", events=("once", "twice"), missed_ticks=3)
    assert recording.close(recording.final_header(report)) == ""
    header = json.loads((tmp_path / "r" / "recording.json").read_text(encoding="utf-8"))
    assert (header["finished"], header["completed"], header["reason"]) == (True, False, "stopped by SIGTERM")
    assert (header["events"], header["missed_ticks"], header["missing_inputs"]) == (["once", "twice"], 3, 0)
    assert [(node["name"], node["node_id"]) for node in header["nodes"]] == [
        ("controller", 127),
        ("axis.x.drive", 1),
        ("axis.x.scale", 11),
        ("axis.y.drive", 2),
        ("axis.y.scale", 12),
    ]
    assert header["modes"] == {"x": "cst", "y": "cst"}
    assert header["limits"]["y"]["force_n"] == 600.0
    assert header["limits"]["x"]["position_m"] == pytest.approx([-0.1, 0.1])
    assert header["monitoring"] == {"required_m": 3e-6, "window_s": 0.194}
    x, y = header["compensation"]["x"], header["compensation"]["y"]
    assert (x["pulse"], x["version"], x["screw"], x["screw_version"]) == (True, 3, True, 2)
    assert (x["waveform"], x["waveform_version"], y["waveform_version"]) == (True, 4, 0)
    assert (y["pulse"], y["version"], y["observer"], y["screw"]) == (True, 0, False, False)


def test_a_run_without_a_cycle_did_not_begin() -> None:
    assert replace(REPORT, cycles=0).as_header()["reason"] == "it never began"
    assert REPORT.as_header()["reason"] == ""
    assert replace(REPORT, cycles=0, reason="a fault").as_header()["reason"] == "a fault"


def test_lost_rows_fail_the_run_and_are_reported_after_its_reason() -> None:
    assert REPORT.with_problem("") is REPORT
    lost = replace(REPORT, reason="stopped").with_problem("3 rows lost")
    assert (lost.failed, lost.reason) == (True, "stopped; 3 rows lost")
    assert REPORT.with_problem("3 rows lost").reason == "3 rows lost"
