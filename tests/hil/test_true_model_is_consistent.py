"""A machine of the repository, recorded over the bus, is consistent with its own plant file.

Short programs are the hard ones: few reversals and seconds of motion tell mass and friction to a few percent
only, and presliding, the rounding of the current and its hold are a large part of what is left. Where the
drive closes the position loop, its current is sampled in step with the jumps of its set points.
"""

from pathlib import Path

import numpy as np
import pytest
from machine_files import REPOSITORY, text_of
from own_plant import diagnosed, recorded

from hil_sim.config import load_plant
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import load_recordings
from reconcile.replay.along_reference import along_reference
from reconcile.sensing.channel import quantum

MACHINES = REPOSITORY / "machines"
PROGRAMS = (
    ("xy_table", "first_move.toml"),
    ("xy_table", "star_inch.nc"),
    ("fuzzy_table", "velocity_step.toml"),
    ("precision_stage", "first_move.toml"),
)
"""Machine and program; all of them, and random plants: `make true-model`."""


@pytest.mark.parametrize(("name", "program"), PROGRAMS)
def test_machine_against_its_own_plant_is_consistent(name: str, program: str, tmp_path: Path) -> None:
    recording = recorded(MACHINES / name, program, tmp_path / "recording")
    verdict = diagnosed(recording, MACHINES / name / "plant.toml")
    assert (verdict["verdict"], verdict["findings"]) == ("consistent", [])


def test_first_move_against_a_lighter_table_shows_its_parameters(tmp_path: Path) -> None:
    """So short a motion is enough to refute a mass: consistent is not all that it can say."""
    recording = recorded(MACHINES / "xy_table", "first_move.toml", tmp_path / "recording")
    text = text_of(MACHINES / "xy_table" / "plant.toml", {"mass_kg = 45.0": "mass_kg = 35.0"})
    lighter = tmp_path / "lighter.toml"
    lighter.write_text(text, encoding="utf-8")
    verdict = diagnosed(recording, lighter)
    assert verdict["verdict"] == "parameters"
    assert verdict["fit"]["x"]["force"]["values"]["mass_kg"] == pytest.approx(70.0, rel=0.03)


def test_plant_led_along_the_set_points_gives_the_current_that_was_recorded(tmp_path: Path) -> None:
    """The drive's set points act one cycle after they are recorded; else nothing differs but rounding."""
    plant = MACHINES / "precision_stage" / "plant.toml"
    recording = recorded(plant.parent, "first_move.toml", tmp_path / "recording", compensation="off")
    [own] = load_recordings([recording], load_model(plant).axes)
    assert own.mode == "csp"
    image = along_reference(own, load_plant(plant))
    assert image is not None
    step_n, count_m = quantum(own.force_n), quantum(own.motor_m)
    assert np.abs(image.force_n[:-1] - own.force_n[1:]).max() < 1.01 * step_n
    assert np.abs(image.motor_m[:-1] - own.motor_m[1:]).max() < 1.01 * count_m
    assert along_reference(own._replace(mode="cst"), load_plant(plant)) is None
