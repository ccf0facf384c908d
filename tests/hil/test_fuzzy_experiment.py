"""The study of position laws, shortened, by a user's command; the fuzzy law on the bus equals the twin."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from machine_files import text_of

from hil_sim.config import load_plant
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program import check_program, program_segments
from servo_ctrl.recording.reader import load_recording
from twin.axis_rollout import COLUMNS
from twin.rollout import rollout

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "machines" / "fuzzy_table"
LIMIT_S = 800.0  # each of 100,000 turns in lockstep waits for others that want the processors
SHORTER = {
    "seconds = 1.0": "seconds = 0.2",
    "amplitude_mm = 5.0": "amplitude_mm = 1.0",
    "frequency_hz = 0.5": "frequency_hz = 2.0",
    "cycles = 5.0": "cycles = 3.0",
}


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the table with shorter motions, and the study run on it."""
    folder = tmp_path_factory.mktemp("fuzzy") / "machine"
    (folder / "programs").mkdir(parents=True)
    for name in (
        "controller.toml",
        "controller_pid.toml",
        "controller_velocity.toml",
        "plant.toml",
        "programs/position.toml",
        "programs/velocity_step.toml",
    ):
        text = text_of(TABLE / name)
        for long, short in SHORTER.items():
            assert name != "programs/position.toml" or long in text
            text = text.replace(long, short)
        (folder / name).write_text(text, encoding="utf-8")
    done = subprocess.run(
        [
            *(str(Path(sys.executable).with_name("servo-ctrl")), "experiment", "fuzzy"),
            *("--machine", str(folder), "--out", str(folder / "out"), "--json", str(folder / "figures.json")),
        ],
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
        env={**os.environ, "COLUMNS": "100"},
    )
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-2000:]
    return folder


def test_the_fuzzy_study_writes_figures_of_both_laws_and_plots(machine: Path) -> None:
    figures = json.loads((machine / "figures.json").read_text(encoding="utf-8"))
    for law in ("pid", "fuzzy_pd"):
        assert figures["step"][law].keys() == {"overshoot_pct", "settling_s"}
        assert 0.0 < figures["step"][law]["settling_s"] < 0.2
        sine = figures["sine"][law]
        assert 0.0 < sine["rms_um"] < sine["peak_um"] < 1000.0
        assert 0.0 < sine["dead_time_s"] < 0.25
    for name in ("surface", "velocity_step", "position_step", "sine"):
        assert (machine / "out" / f"{name}.png").stat().st_size > 10_000


def test_the_fuzzy_law_gives_the_same_bits_over_the_bus_and_in_the_twin(machine: Path) -> None:
    (directory,) = (machine / "out" / "recordings").glob("controller-position-*")
    bus = load_recording(directory).columns
    config = load_machine(machine)
    program = load_program(machine / "programs" / "position.toml", config)
    engaged = int(np.flatnonzero(np.isfinite(bus["x.position_command_m"]))[0])
    started = int(np.flatnonzero(bus["segment"] >= 0)[0])
    pieces = list(program_segments(check_program(program, config), config, np.zeros(1)))
    names = ("position_m", "velocity_m_s", "acceleration_m_s2", "force_offset_n")
    moving = np.column_stack([np.concatenate([getattr(p, name)[:, 0] for p in pieces]) for name in names])
    reference = {"x": np.vstack((np.zeros((started, 4)), moving))}
    params = {"x": axis_params(config, "x")}
    assert params["x"].fuzzy.enabled
    twin = rollout(config, load_plant(machine), params, reference, off_cycles=engaged)
    count = len(twin["time_s"])
    for name in COLUMNS:
        np.testing.assert_array_equal(
            bus[f"x.{name}"][engaged:count], twin[f"x.{name}"][engaged:], err_msg=name
        )
