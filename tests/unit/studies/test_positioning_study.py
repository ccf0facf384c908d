"""Figures of the positioning study from made-up readings: simple ones, slope, bars, the file between."""

import csv
from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.errors import ServoCtrlError
from studies.wang_2014.plan import DOWN, OVER_TRAVEL, UP, Visit
from studies.wang_2014.readings import Deviations, Reading, ReadingsError, deviations, write_readings
from studies.wang_2014.stages import PAPER
from studies.wang_2014.study import bars, missed, simple, summary
from studies.wang_2014.twin_study import TwinRequest, run_in_twin

UM = 1e-6
TARGETS_MM = np.array([5.0, 10.0, 20.0])


def both_ways(size_um: float, slope_um_mm: float = 0.0) -> Deviations:
    """Two runs: up at +size, down at -size, and a slope over the targets."""
    size = np.full((2, 3, 2), size_um) * [1.0, -1.0] + (slope_um_mm * TARGETS_MM)[:, np.newaxis]
    return Deviations(TARGETS_MM, size * UM, size * UM)


def study(*sizes_um: float, slope_um_mm: float = 0.0) -> dict[tuple[str, str], Deviations]:
    return {
        (series, stage.name): both_ways(size_um, slope_um_mm if stage.name == "smoothed" else 0.0)
        for series in ("at_100mm", "over_travel")
        for stage, size_um in zip(PAPER, sizes_um, strict=True)
    }


def test_simple_figures_are_largest_mean_range_and_slope() -> None:
    deviation_um = np.array([[[1.0, -3.0], [2.0, -2.0], [4.0, 0.0]], [[1.5, -3.0], [2.0, -2.0], [4.0, 0.0]]])
    figures = simple(TARGETS_MM, deviation_um * UM)
    assert figures.largest_um == pytest.approx(4.0)
    assert figures.mean_um == pytest.approx(24.5 / 12.0)
    assert figures.half_range_um == pytest.approx(0.25)
    means = [(1.0 + 1.5 - 6.0) / 4.0, 0.0, 2.0]
    assert figures.slope_um_mm == pytest.approx(np.polyfit(TARGETS_MM, means, 1)[0])


def test_stages_that_get_better_and_end_small_and_flat_meet_every_bar() -> None:
    entries = bars(study(25.0, 12.0, 6.0, 0.5))
    assert len(entries) == 2 * (3 + 1) + 1
    assert not missed(entries)


@pytest.mark.parametrize(
    ("found", "what"),
    [
        (study(25.0, 25.0, 6.0, 0.5), "open_loop below uncompensated"),
        (study(25.0, 12.0, 6.0, 1.2), "smoothed, largest"),
        (study(25.0, 12.0, 6.0, 0.5, slope_um_mm=0.04), "smoothed flat"),
    ],
)
def test_a_missed_bar_is_reported(found: dict[tuple[str, str], Deviations], what: str) -> None:
    assert any(what in bar.what for bar in missed(bars(found)))


def test_the_summary_has_the_figures_of_every_stage() -> None:
    figures = summary(study(25.0, 12.0, 6.0, 0.5, slope_um_mm=0.01))
    for series in ("at_100mm", "over_travel"):
        assert figures[series]["uncompensated_um"] == pytest.approx(25.0)
        assert figures[series]["open_loop_um"] == pytest.approx(12.0)
        assert figures[series]["sampled_dual_loop_um"] == pytest.approx(6.0)
        assert figures[series]["smoothed_um"] == pytest.approx(0.7)
    assert figures["over_travel"]["slope_smoothed_um_per_mm"] == pytest.approx(0.01)
    assert figures["iso_230_2"]["open_loop"]["B_um"] == pytest.approx(24.0)
    assert figures["iso_230_2"]["open_loop"]["by_scale"]["A_um"] == pytest.approx(24.0)


def readings() -> list[Reading]:
    return [
        Reading(
            "over_travel", "smoothed", Visit(run, target, way), 5.0 * target, 1.5, 0.1 + target, -1e-7 * way
        )
        for run in range(2)
        for target in range(3)
        for way in (UP, DOWN)
    ]


def test_readings_become_arrays_by_run_target_and_direction() -> None:
    found = deviations(readings())["over_travel", "smoothed"]
    assert found.scale_m.shape == (2, 3, 2)
    for reading in readings():
        place = tuple(reading.visit)
        assert found.scale_m[place] == reading.scale_m
        assert found.interferometer_m[place] == reading.interferometer_m
        assert found.target_mm[reading.visit.target] == reading.target_mm


def test_readings_are_written_to_the_last_bit(tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    write_readings(path, readings())
    with path.open(newline="", encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert [float(line["scale_m"]) for line in lines] == [reading.scale_m for reading in readings()]
    assert [int(line["run"]) for line in lines] == [reading.visit.run for reading in readings()]


def test_readings_with_a_gap_are_refused() -> None:
    with pytest.raises(ReadingsError, match="should have 12 finite readings, there are 11"):
        deviations(readings()[:-1])


def test_a_machine_that_is_not_there_is_named(tmp_path: Path) -> None:
    request = TwinRequest(["smoothed"], 2, 2, [OVER_TRAVEL.name])
    with pytest.raises(ServoCtrlError, match="nowhere"):
        run_in_twin(tmp_path / "nowhere", tmp_path, request, lambda _share: None)
