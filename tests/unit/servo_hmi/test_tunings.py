"""Tunings are found below directories, the newest first, and their files are checked."""

import json
import os
from pathlib import Path

import pytest

from servo_ctrl.hmi.shell.plots import LIGHT, Look
from servo_ctrl.hmi.shell.units import MM
from servo_ctrl.hmi.tuning.bode import HIGHEST_SENSITIVITY, sensitivity_figure
from servo_ctrl.hmi.tuning.tunings import BodeCurve, TuningError, read_curves, read_figures, tunings_below


def tuned(directory: Path, time_s: float = 0.0, text: str = "{}") -> Path:
    directory.mkdir(parents=True)
    (directory / "tune.json").write_text(text, encoding="utf-8")
    os.utime(directory / "tune.json", (time_s, time_s))
    return directory


def test_the_newest_is_the_first_and_one_in_two_places_is_named_once(tmp_path: Path) -> None:
    old, new = tuned(tmp_path / "a" / "b", 1000.0), tuned(tmp_path / "out", 2000.0)
    tuned(tmp_path / "a" / "b" / "c" / "too_deep", 3000.0)
    found = tunings_below([tmp_path, tmp_path / "out", tmp_path / "nowhere"])
    assert [one.directory for one in found] == [new, old]
    assert found[1].place == "a/b"


def test_links_are_not_followed(tmp_path: Path) -> None:
    tuned(tmp_path / "elsewhere")
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "link").symlink_to(tmp_path / "elsewhere")
    assert tunings_below([tmp_path / "here"]) == []


@pytest.mark.parametrize(
    ("text", "complaint"),
    [("{", "is not JSON"), ('{"machine": 3}', "machine: "), ("[" * 100_000, "is not JSON")],
)
def test_a_damaged_file_is_named_with_what_is_wrong(tmp_path: Path, text: str, complaint: str) -> None:
    directory = tuned(tmp_path / "out", text=text)
    with pytest.raises(TuningError, match=rf"tune\.json: {complaint}"):
        read_figures(directory)


def test_curves_are_missing_in_a_tuning_of_an_earlier_version(tmp_path: Path) -> None:
    assert read_curves(tuned(tmp_path / "out")) is None
    (tmp_path / "out" / "bode.json").write_text(json.dumps({"plant": []}), encoding="utf-8")
    with pytest.raises(TuningError, match=r"bode\.json: loop"):
        read_curves(tmp_path / "out")


def test_the_sensitivity_is_that_of_the_loop_and_cut_off() -> None:

    # at -180 degrees |1 + L| is 1 - |L|, at -90 degrees its square is 1 + |L|^2
    curve = BodeCurve(
        name="after",
        frequency_hz=[1.0, 2.0, 3.0],
        magnitude=[0.5, 0.75, 0.999],
        phase_deg=[-180.0, -90.0, 180.0],
    )
    drawn = sensitivity_figure([curve], 2.0, Look(MM, LIGHT))["data"][0]["y"]
    assert drawn == pytest.approx([2.0, 0.8, HIGHEST_SENSITIVITY])
