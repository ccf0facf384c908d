"""`servo-ctrl learned`: versions listed, shown, rolled back and drawn, without a bus."""

import json
import math
import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result
from learned_examples import LEARNED, table_in
from matplotlib import pyplot as plt
from pydantic import ValidationError
from screw_stand import stage_file
from typer.testing import CliRunner
from waveform_examples import example_waveform

from servo_ctrl.cli.learned import app
from servo_ctrl.config.load import load_machine
from servo_ctrl.learned.store import LearnedStore, ScrewStore, StoreError, default_directory
from servo_ctrl.learned.waveform_model import FrictionPart, LearnedWaveform
from servo_ctrl.learning.screw import ScrewLearned

RUNNER = CliRunner()
NO_SECOND_TRAPEZOID = LEARNED._replace(
    learner="paper",
    strokes=812,
    trailing=(),
    after_m=1.2e-6,
    durations=tuple((a, 0.8 * t) for a, t in LEARNED.durations),
)


@pytest.fixture
def store(tmp_path: Path) -> LearnedStore:
    """One version for each axis."""
    machine = table_in(tmp_path / "table")
    store = LearnedStore(default_directory(machine), machine)
    store.add("x", LEARNED, {"operator": "[/red] E"})
    store.add("y", NO_SECOND_TRAPEZOID, {})
    return store


def learned(store: LearnedStore | ScrewStore, *arguments: str) -> Result:
    machine = str(store.directory.parent)
    return RUNNER.invoke(app, [*arguments, "--machine", machine], env={"COLUMNS": "80"})


def versions(output: str) -> list[list[str]]:
    """The words of the lines of versions."""
    return [line.split() for line in output.splitlines() if re.match(r" *[xy] +\d", line)]


def rows(output: str) -> list[list[str]]:
    """The cells of a table, by row."""
    return [
        [cell.strip() for cell in line.strip("│").split("│")] for line in output.splitlines() if "│" in line
    ]


def test_list_shows_every_version_and_which_is_in_use(store: LearnedStore) -> None:
    store.add("x", LEARNED._replace(after_m=0.9e-6), {})
    store.roll_back("x")
    result = learned(store, "list")
    assert result.exit_code == 0
    assert [line[:4] + line[5:] for line in versions(result.stdout)] == [
        ["x", "1", "yes", "yes", "fast", "61", "5.25", "->", "1.12"],
        ["x", "2", "no", "yes", "fast", "61", "5.25", "->", "0.90"],
        ["y", "1", "yes", "yes", "paper", "812", "5.25", "->", "1.20"],
    ]
    assert [line[0] for line in versions(learned(store, "list", "--axis", "y").stdout)] == ["y"]


def test_list_marks_a_damaged_version_with_advice(store: LearnedStore) -> None:
    path = store.directory / "x" / "v0001.json"
    path.write_text(path.read_text(encoding="utf-8").replace("0.31", "0.32"), encoding="utf-8")
    result = learned(store, "list")
    assert result.exit_code == 0
    assert versions(result.stdout)[0] == ["x", "1", "yes", "no"]
    assert "axis x, version 1: is damaged: its checksum (sha256) does not fit\n" in result.stdout
    assert "axis x runs without a learned pulse: " in result.stdout
    assert "v0001.json: is damaged: its checksum (sha256) does not fit; learn axis x again" in result.stdout


def test_list_where_nothing_was_learned(tmp_path: Path) -> None:
    machine = table_in(tmp_path / "table")
    result = learned(LearnedStore(default_directory(machine), machine), "list")
    assert result.exit_code == 0
    for axis in "xy":
        for whose in ("", " of the waveform"):
            assert f"axis {axis}: no version{whose} is in use\n" in result.stdout


def test_list_of_another_directory(store: LearnedStore, tmp_path: Path) -> None:
    store.directory.rename(tmp_path / "elsewhere")
    assert versions(learned(store, "list").stdout) == []
    assert len(versions(learned(store, "list", "--learned", str(tmp_path / "elsewhere")).stdout)) == 2


def test_show_lists_every_value_in_millimetres(store: LearnedStore) -> None:
    result = learned(store, "show", "--axis", "x")
    assert result.exit_code == 0
    for text in (
        "axis x of xy_table, version 1, in use",
        "61 strokes, 6.9 min of machine time",
        "J 5.25 um before, 1.12 um after",
        "control.kp_1_s = 38.7",
        "operator = [/red] E",
        "GRNN with spread 5 mm/s^2",
    ):
        assert text in result.stdout
    assert rows(result.stdout) == [
        *([f"{a * 1e3:.4g}", f"{t * 1e3:.4g}"] for a, t in LEARNED.durations),
        *([f"{a * 1e3:.4g}", f"{v * 1e3:.4g}"] for a, v in LEARNED.amplitudes),
        ["2", "200", "50", "-0.1"],
        ["120", "30", "20", "-0.4"],
    ]


def test_show_of_another_version_and_one_that_does_not_fit_any_more(
    store: LearnedStore, tmp_path: Path
) -> None:
    store.add("x", NO_SECOND_TRAPEZOID, {})
    assert "version 1\n" in learned(store, "show", "--axis", "x", "--version", "1").stdout
    table_in(tmp_path / "table", ("kp_1_s = 38.7", "kp_1_s = 40.0"))
    result = learned(store, "show", "--axis", "x")
    assert "version 2, in use\ncannot be used: does not fit" in result.stdout


def test_show_as_json_is_what_is_stored(store: LearnedStore) -> None:
    result = learned(store, "show", "--axis", "x", "--json")
    assert json.loads(result.stdout) == json.loads(
        (store.directory / "x" / "v0001.json").read_text(encoding="utf-8")
    )


def test_show_of_a_missing_version_is_an_error(store: LearnedStore) -> None:
    error = learned(store, "show", "--axis", "x", "--version", "7").exception
    assert isinstance(error, StoreError)
    assert str(error).endswith("axis x: there is no version 7; versions: 1")
    store.roll_back("x")
    assert "no version is in use; versions: 1" in str(learned(store, "show", "--axis", "x").exception)
    assert 'has no axis "z"' in str(learned(store, "show", "--axis", "z").exception)


def test_rollback_goes_to_the_version_before_and_then_to_none(store: LearnedStore) -> None:
    store.add("x", LEARNED, {})
    assert "axis x: version 1 of 20" in learned(store, "rollback", "--axis", "x").stdout
    active = store.active("x")
    assert active is not None
    assert active.version == 1
    assert learned(store, "rollback", "--axis", "x").stdout == "axis x: no version is in use\n"
    assert store.active("x") is None
    assert store.active("y") is not None


def test_plot_draws_both_functions_of_all_axes(store: LearnedStore, tmp_path: Path) -> None:
    out = tmp_path / "pictures" / "learned.png"
    result = learned(store, "plot", "--out", str(out))
    assert result.exit_code == 0, result.exception
    picture = plt.imread(out)
    height, width = picture.shape[:2]
    for half in (picture[:, : width // 2], picture[:, width // 2 :]):
        for blue, red in ((0xB2 / 255.0, 0x00), (0x00, 0xD5 / 255.0)):  # x and y
            hit = (abs(half[:, :, 2] - blue) < 0.01) & (abs(half[:, :, 0] - red) < 0.01)
            assert hit[: height * 3 // 4].sum() > 300
    assert not list(out.parent.glob("*.tmp"))


def test_plot_without_anything_in_use_is_an_error(store: LearnedStore, tmp_path: Path) -> None:
    for axis in ("x", "y"):
        store.roll_back(axis)
    result = learned(store, "plot", "--out", str(tmp_path / "none.png"))
    assert "no version is in use, there is nothing to draw" in str(result.exception)
    assert not (tmp_path / "none.png").exists()


@pytest.mark.parametrize("command", ["list", "show", "rollback", "plot"])
def test_help_shows_an_example(command: str) -> None:
    result = RUNNER.invoke(app, [command, "--help"], env={"COLUMNS": "200"})
    assert f"servo-ctrl learned {command} --machine" in result.stdout


@pytest.fixture
def screws(tmp_path: Path) -> ScrewStore:
    """Two versions; the second is in use."""
    machine = load_machine(stage_file(tmp_path / "stage"))
    store = ScrewStore(default_directory(machine), machine)
    points = ((-0.006, -1e-6, 6.1e-6), (0.0, 0.0, 6e-6), (0.00601, 2.5e-6, 5.9e-6))
    learned = ScrewLearned(points, 6e-6, 3e-8, 5e-6, 1e-7, 4, 90.0)
    store.add("x", learned, {})
    store.add("x", learned._replace(after_m=5e-8), {})
    return store


def test_screws_are_listed_shown_and_rolled_back(screws: ScrewStore) -> None:
    assert [line[:4] + line[5:] for line in versions(learned(screws, "list").stdout)] == [
        ["x", "1", "no", "yes", "screw", "4", "5.00", "->", "0.10"],
        ["x", "2", "yes", "yes", "screw", "4", "5.00", "->", "0.05"],
    ]
    shown = learned(screws, "show", "--axis", "x", "--kind", "screw").stdout
    assert "lost motion 6.00 um, 5.90 to 6.10 um over the travel" in shown
    assert "homing_method = 37" in shown
    assert rows(shown) == [
        ["-6.0000", "-1.000", "6.100"],
        ["0.0000", "0.000", "6.000"],
        ["6.0100", "2.500", "5.900"],
    ]
    rolled = learned(screws, "rollback", "--axis", "x", "--kind", "screw").stdout
    assert rolled.startswith("axis x: version 1 of 20")
    learned(screws, "rollback", "--axis", "x", "--kind", "screw")
    assert "axis x: no version of the screw is in use\n" in learned(screws, "list").stdout


def test_screws_are_drawn(screws: ScrewStore, tmp_path: Path) -> None:
    out = tmp_path / "screw.png"
    result = learned(screws, "plot", "--kind", "screw", "--out", str(out))
    assert result.exit_code == 0, result.exception
    picture = plt.imread(out)
    blue = (abs(picture[:, :, 2] - 0xB2 / 255.0) < 0.01) & (picture[:, :, 0] < 0.01)
    height = len(picture)
    assert all(half.sum() > 100 for half in (blue[: height // 2], blue[height // 2 :]))
    without = learned(screws, "plot", "--out", str(tmp_path / "none.png"))
    assert "no version is in use, there is nothing to draw" in str(without.exception)


def test_a_waveform_of_an_earlier_release_has_no_force_over_jerk() -> None:
    friction = LearnedWaveform.values(example_waveform())["friction"]
    assert FrictionPart.model_validate(friction).per_jerk_kg_s == 0.1
    del friction["per_jerk_kg_s"]
    assert FrictionPart.model_validate(friction).per_jerk_kg_s == 0.0


def test_forces_behind_rests_are_read_as_they_were_written_and_may_be_absent() -> None:
    values = LearnedWaveform.values(example_waveform())
    assert LearnedWaveform.model_validate(values).learned() == example_waveform()
    del values["rests"]
    assert LearnedWaveform.model_validate(values).learned() == example_waveform()._replace(rests=())


@pytest.mark.parametrize(
    ("place", "key", "value", "reason"),
    [
        (1, "rest_s", 0.05, "the rests must rise"),
        (0, "rest_s", 0.0, "greater than 0"),
        (0, "turned_n", [0.1], "as many forces of both kinds"),
        (1, "onward_n", [], "at least 1 item"),
        (0, "onward_n", [0.0, math.nan, 0.0, 0.0], "finite"),
        (0, "onward_n", [0.0, 2e6, 0.0, 0.0], "less than or equal to 1000000"),
    ],
)
def test_impossible_forces_behind_rests_are_refused(place: int, key: str, value: Any, reason: str) -> None:
    values = LearnedWaveform.values(example_waveform())
    values["rests"][place][key] = value
    with pytest.raises(ValidationError, match=reason):
        LearnedWaveform.model_validate(values)
