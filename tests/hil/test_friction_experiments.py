"""The friction study and the study of changing friction, shortened, by the commands of a user."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from machine_files import text_of
from program_steps import circle_about_origin

ROOT = Path(__file__).parents[2]
XY_TABLE = ROOT / "machines" / "xy_table"
LIMIT_S = 800.0  # each of 100,000 turns in lockstep waits for others that want the processors
INDICATORS = ["contour_peak_um", "mean_um", "peak_um", "rms_um"]
QUICK = {
    "radius_mm = 50.0": "radius_mm = 3.0\nsteps = [1, 1, 1]\ncoarse_steps = 4\nfine_steps = 2\n"
    "duration_step_ms = 20.0",
    "accelerations_mm_s2 = [2.0, 8.0, 30.0, 120.0]": "accelerations_mm_s2 = [85.0, 95.0, 105.0, 120.0]",
    "jerk_mm_s3 = 50000.0": "jerk_mm_s3 = 1000000.0",
}
"""Strokes of a second at about the reverse acceleration of the motions below: 100 mm/s^2."""
S_SHAPE = """
[[step]]
kind = "s_shape"
label = "S"
axis = "y"
distance_mm = 20.0
velocity_mm_s = 40.0
acceleration_mm_s2 = 100.0
"""


def production_circle(turns: float) -> str:
    return circle_about_origin(25.0, 3000.0, turns, label="F 3000", ramp_s=0.5, move_mm_min=6000.0)


def table(folder: Path, replacements: dict[str, str]) -> Path:
    """Copy the X-Y table with other settings, short programs, and an early loss of lubrication."""
    machine = folder / "machine"
    (machine / "programs").mkdir(parents=True)
    for name in ("controller.toml", "plant.toml", "plant_lubrication_loss.toml"):
        text = text_of(XY_TABLE / name, replacements if name == "controller.toml" else None)
        text = text.replace("start_s = 60.0", "start_s = 11.0").replace(
            "transition_s = 2.0", "transition_s = 0.5"
        )
        (machine / name).write_text(text, encoding="utf-8")
    for name, text in {
        "circles": production_circle(1.3),
        "production": production_circle(3.0),
        "s_shapes": S_SHAPE,
    }.items():
        (machine / "programs" / f"{name}.toml").write_text(text, encoding="utf-8")
    return machine


def experiment(*arguments: str) -> str:
    command = [str(Path(sys.executable).with_name("servo-ctrl")), "experiment", *arguments]
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
        env={**os.environ, "COLUMNS": "100"},
    )
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-2000:]
    return done.stdout


def test_the_friction_study_reduces_every_indicator_and_beats_the_observer(tmp_path: Path) -> None:
    machine, out = table(tmp_path, QUICK), tmp_path / "out"
    printed = experiment(
        *("friction", "--machine", str(machine), "--out", str(out), "--json", str(tmp_path / "f.json")),
        *("--strokes", "1"),
    )
    figures: dict[str, Any] = json.loads((tmp_path / "f.json").read_text(encoding="utf-8"))
    cells = figures["circle"] + figures["s_shaped"]
    assert [(cell["axis"], cell["feed_mm_min"]) for cell in figures["circle"]] == [("x", 3000), ("y", 3000)]
    assert [cell["name"] for cell in figures["s_shaped"]] == ["S"]
    for cell in cells:
        for name in INDICATORS:
            assert cell["WFC"][name] < cell["WDOB"][name] < cell["WTFC"][name]
        assert list(cell["WFC"]) == INDICATORS
    learning = figures["learning"]
    assert learning["strokes_fast"] < learning["strokes_paper"]
    assert learning["J_fast"] < learning["paper"]["axes"]["x"]["before"]
    repeated = learning["repeated_on_bus"]["strokes"]
    assert [stroke["axis"] for stroke in repeated] == ["x", "y"]
    for stroke in repeated:
        assert stroke["J_bus"] == pytest.approx(stroke["J_twin"], abs=1e-3), "a nanometre"
    assert "Feng et al. 2015" in printed
    for name in ("learned_paper", "learned_fast", "quadrants", "contours", "s_shapes"):
        assert (out / f"{name}.png").stat().st_size > 10_000


def test_friction_that_changes_is_noticed_and_learned_again_over_the_bus(tmp_path: Path) -> None:
    quicker = {
        "steps = [1, 1, 1]": "steps = [1, 1, 1]\ntrailing = false",
        "required_um = 4.0": "required_um = 5.0",
    }
    machine = table(tmp_path, {**QUICK, **quicker})
    printed = experiment(
        *("drift", "--machine", str(machine), "--out", str(tmp_path), "--json", str(tmp_path / "d.json"))
    )
    figures = json.loads((tmp_path / "d.json").read_text(encoding="utf-8"))
    evaluations, required = figures["J_um"], figures["J_required_um"]
    assert evaluations["compensated"] < required
    assert evaluations["friction changed"] > required
    assert evaluations["learned again"] < required
    instants = list(figures["instants"].values())
    assert instants == sorted(instants)
    assert "learning is due" in printed
    assert figures["learning"]["version"] == 2
    flags = [entry["due"] for entry in figures["reversals"] if entry["axis"] == "x"]
    assert (flags[0], True in flags, flags[-1]) == (False, True, False)
    assert (tmp_path / "drift.png").stat().st_size > 10_000
