"""A part program over the bus, as a user runs it: the daemon, the hub and the simulator in lockstep."""

import json
from pathlib import Path
from typing import Any

from typer.testing import CliRunner

from servo_ctrl.cli.main import app
from servo_ctrl.recording.reader import load_recording


def test_an_example_is_run_and_its_contour_error_reported(bench: Any, xy_table: Path, tmp_path: Path) -> None:
    bench.simulate(xy_table)
    program = xy_table / "programs" / "star_inch.nc"
    arguments = ["run", "--machine", str(xy_table), "--bus", bench.bus_spec, "--pacing", "lockstep"]
    arguments += [
        "--program",
        str(program),
        "--g54",
        "x=3",
        "--record",
        str(tmp_path / "r"),
        "--no-compensation",
    ]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    recording = load_recording(tmp_path / "r")
    assert recording.header["completed"]
    assert [entry["kind"] for entry in recording.header["segments"]] == ["path", "path", "dwell", "path"]
    # the tips of the star, as the file has them, from G54
    points = {"lines 4-13": (0.003, 0.8 * 25.4e-3), "line 15": (0.003, 0.0)}
    for label, end_m in points.items():
        part = recording.segment(label)
        for axis, position_m in zip(("x", "y"), end_m, strict=True):
            assert abs(part[f"{axis}.position_command_m"][-1] - position_m) < 1e-12
            assert abs(part[f"{axis}.scale_position_m"][-1] - position_m) < 20e-6
    written = json.loads((tmp_path / "r" / "contour_error.json").read_text(encoding="utf-8"))
    assert written["rounding"]["max_um"] <= 50.8
    assert 0.1 < written["to_command"]["rms_um"] < 20.0  # friction at the reversals, uncompensated
    assert (
        written["to_program"]["max_um"]
        < written["rounding"]["max_um"] + written["to_command"]["max_um"] + 0.1
    )
    assert "contour error against the program: RMS " in result.output
    assert f"(line {written['to_program']['line']})" in result.output
