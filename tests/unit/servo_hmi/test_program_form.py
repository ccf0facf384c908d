import tomllib
from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.errors import ConfigError
from servo_ctrl.hmi.motion.path_picture import path_picture, round_step
from servo_ctrl.hmi.motion.programs import preview_of, programs_in, read_program, save_program
from servo_ctrl.hmi.motion.step_fields import MODELS, fields_of, put_value, shown_value, steps_of, text_of
from servo_ctrl.hmi.shell.plots import LIGHT
from servo_ctrl.hmi.shell.units import MM

MACHINE = Path(__file__).parents[3] / "machines" / "xy_table"
CIRCLES = MACHINE / "programs" / "circles.toml"


@pytest.mark.parametrize("kind", sorted(set(MODELS) - {"samples"}))
def test_every_key_of_a_step_but_its_kind_is_a_field_with_its_meaning(kind: str) -> None:
    fields = fields_of(kind, ["x", "y"])
    assert {field.key for field in fields} | {"kind"} == set(MODELS[kind].model_fields)
    assert all(field.meaning for field in fields)


def test_a_program_goes_through_the_form_unchanged() -> None:
    text = CIRCLES.read_text()
    steps = steps_of(text)
    assert steps is not None
    for step in steps:
        for field in fields_of(step["kind"], ["x", "y"]):
            put_value(step, field, shown_value(step, field))
    assert tomllib.loads(text_of(steps)) == {"format": 1, **tomllib.loads(text)}


def test_a_filled_field_sets_its_key_and_an_empty_one_removes_it() -> None:
    step = {"kind": "move", "to_mm": {"x": 1.0}, "feed_mm_min": 100.0}
    fields = {(field.key, field.axis): field for field in fields_of("move", ["x", "y"])}
    put_value(step, fields["to_mm", "y"], "2,5")
    put_value(step, fields["to_mm", "x"], "")
    put_value(step, fields["feed_mm_min", ""], "fast")
    put_value(step, fields["acceleration_mm_s2", ""], "")
    assert step == {"kind": "move", "to_mm": {"y": 2.5}, "feed_mm_min": "fast"}


@pytest.mark.parametrize(
    "text",
    [
        "step = 3",
        "a = 1\n",
        "[[step]]\nkind = 'x'\n",
        "=",
        "other = 1\n[[step]]\nkind='dwell'",
        "step = " + "9" * 5000,
        "step = " + "[" * 5000,
    ],
)
def test_an_invalid_program_has_no_form(text: str) -> None:
    assert steps_of(text) is None


def test_the_preview_has_extents_and_length_of_the_program() -> None:
    preview = preview_of(MACHINE / "controller.toml", CIRCLES.name, CIRCLES.read_text())
    assert preview.run.highest_m == pytest.approx((0.025, 0.025), abs=1e-6)
    turns = 2.0 * np.pi * 0.025 * (1.1 + 1.1 + 1.2 + 1.3)
    chords = sum(2.0 * 0.025 * np.sin(np.pi * turn) for turn in (0.1, 0.1, 0.2))
    assert preview.run.length_m == pytest.approx(0.025 + turns + chords + 0.025, rel=1e-5)
    steps_m = np.linalg.norm(np.diff(preview.position_m, axis=0), axis=1)
    assert steps_m.max() < 1.01 * preview.run.length_m / (len(preview.position_m) - 1)


def test_the_loaders_error_names_the_program_and_no_path() -> None:
    text = CIRCLES.read_text().replace("radius_mm = 25.0", "radius_mm = -1.0", 1)
    with pytest.raises(ConfigError) as caught:
        preview_of(MACHINE / "controller.toml", "mine.toml", text)
    assert str(caught.value).startswith('mine.toml: step[2] "F 500".radius_mm: ')


@pytest.mark.parametrize("name", ["../x.toml", "x", "x.py", "", ".toml", "a/b.toml", "a\0.toml", "x.toml\n"])
def test_only_names_of_programs_are_read_and_written(tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigError, match="not a name for a program"):
        save_program(tmp_path, name, "")
    with pytest.raises(ConfigError, match="not a name for a program"):
        read_program(tmp_path, name)
    assert list(tmp_path.iterdir()) == []


def test_a_saved_program_is_listed_and_read_back(tmp_path: Path) -> None:
    save_program(tmp_path / "programs", "part 1.ngc", "G0 X1\n")
    assert programs_in(tmp_path / "programs") == ["part 1.ngc"]
    assert read_program(tmp_path / "programs", "part 1.ngc") == "G0 X1\n"
    assert programs_in(tmp_path / "nothing") == []


@pytest.mark.parametrize("least", [0.00123, 1.0, 1.1, 4.9, 5.1, 99.0])
def test_a_step_of_the_grid_is_one_two_or_five(least: float) -> None:
    step = round_step(least)
    assert least <= step * (1.0 + 1e-9) <= 2.6 * least
    assert f"{step:.0e}"[0] in "125"


@pytest.mark.parametrize(
    "path_m", [[[0.0, 0.0]], [[0.0, 0.0], [0.05, 0.0]], [[0.0, 0.0], [0.03, 0.04], [-0.01, 0.0]]]
)
def test_every_point_of_a_path_is_in_its_picture_and_to_scale(path_m: list[list[float]]) -> None:
    path = np.array(path_m)
    picture = path_picture(path, np.ones(len(path)), MM.length, LIGHT)
    for across_m, up_m in path:
        assert picture.place_of(across_m, up_m) is not None
    assert picture.place_of(10.0, 0.0) is None
    [_, _, width, height] = (float(part) for part in picture.svg.split('viewBox="')[1].split('"')[0].split())
    assert width / height == pytest.approx(picture.width_m / picture.height_m, rel=1e-3)
