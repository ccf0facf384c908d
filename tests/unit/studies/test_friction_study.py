"""From measured figures to reductions and bars, by hand."""

import io
from pathlib import Path

import pytest
from friction_results import study
from rich.console import Console

from servo_ctrl.metrology.circles import ReversalFigures
from studies.feng_2015.friction_run import draw_study
from studies.feng_2015.published import FENG_2015_X_OBSERVER, FENG_2015_X_PULSE
from studies.feng_2015.published import FENG_2015_X_UNCOMPENSATED as WITHOUT
from studies.feng_2015.report import print_figures
from studies.feng_2015.study import Cell, bars, cells, missed, reductions_percent, summary

XY_TABLE = Path(__file__).parents[3] / "machines" / "xy_table"


def test_a_reduction_is_what_is_missing_from_the_figure_without_compensation() -> None:
    cell = cells(study(pulse=0.25).results)[0]
    assert reductions_percent(cell) == pytest.approx(ReversalFigures(75.0, 75.0, 75.0, 75.0))
    assert reductions_percent(cell, "WDOB") == pytest.approx((40.0,) * 4)


def test_the_published_pulse_meets_its_own_claims_and_is_below_the_published_observer() -> None:
    for feed, without in WITHOUT.items():
        figures = {"WTFC": without, "WFC": FENG_2015_X_PULSE[feed], "WDOB": FENG_2015_X_OBSERVER[feed]}
        cell = Cell("x", f"F {feed}", feed, figures)
        claims = [bar.reduction_percent - bar.claim_percent for bar in bars(cell)]
        # "more than 63 %, 54 %, ...": one of their sixteen rounds down to it (mean at F 500: 53.8 %)
        assert min(claims) > -0.5
        assert all(bar.below_observer for bar in bars(cell))


def test_each_group_of_motions_has_its_own_claims() -> None:
    # 70 % less: enough for x (63, 54, 63, 58), too little of y's peaks (71), of all of S (76, 71, 76, 75)
    found = [(bar.cell.group, bar.cell.label, bar.indicator) for bar in missed(cells(study(0.3).results))]
    y = [("y", f"F {feed}", peak) for feed in (500, 3000) for peak in ("contour_peak_um", "peak_um")]
    shapes = [("S", "S1", name) for name in ReversalFigures._fields]
    assert found == [*y, *shapes]


def test_a_pulse_that_is_no_better_than_the_observer_misses_its_bar() -> None:
    assert not missed(cells(study(pulse=0.15, observer=0.16).results))
    found = missed(cells(study(pulse=0.15, observer=0.15).results))
    assert len(found) == 5 * 4
    assert not any(bar.below_observer for bar in found)


def test_the_json_has_every_cell_with_the_four_indicators_of_each_variant() -> None:
    figures = summary(study())
    cells_found = [(entry["axis"], entry["feed_mm_min"]) for entry in figures["circle"]]
    assert cells_found == [("x", 500), ("x", 3000), ("y", 500), ("y", 3000)]
    assert [entry["name"] for entry in figures["s_shaped"]] == ["S1"]
    for entry in figures["circle"] + figures["s_shaped"]:
        for name in ("WTFC", "WFC", "WDOB"):
            assert list(entry[name]) == ["contour_peak_um", "mean_um", "peak_um", "rms_um"]
    assert figures["circle"][0]["WTFC"]["peak_um"] == pytest.approx(20.0)
    learning = figures["learning"]
    assert (learning["strokes_paper"], learning["strokes_fast"]) == (3200, 130)
    assert (learning["J_paper"], learning["J_fast"]) == pytest.approx((0.8, 0.7))


def _printed(**shares: float) -> str:
    console = Console(width=80, record=True, file=io.StringIO())
    print_figures(console, summary(study(**shares)))
    return console.export_text()


def test_the_report_fits_a_terminal_and_has_the_published_figures_beside_ours() -> None:
    text = _printed()
    assert max(map(len, text.splitlines())) <= 80
    assert "20.00 (20.09)" in text
    assert "3.00 (5.30)" in text
    assert "every bar is met" in text


def test_the_report_names_a_missed_bar_with_reduction_and_claim() -> None:
    text = _printed(pulse=0.3)
    assert "missed: y F 500 peak_um: 70.0 % of 71 %" in text
    assert "every bar is met" not in text


def test_pictures_are_drawn_of_functions_quadrants_contours_and_s_shapes(tmp_path: Path) -> None:
    files = draw_study(XY_TABLE, study(), tmp_path)
    assert {file.stem for file in files} == {
        "learned_paper",
        "learned_fast",
        "quadrants",
        "contours",
        "s_shapes",
    }
    assert all(file.stat().st_size > 10_000 for file in files)


def test_learned_waveforms_and_rivals_stand_beside_the_variants_of_the_bus() -> None:
    whole = summary(study())
    for entry in whole["circle"] + whole["s_shaped"]:
        assert entry["LWC"]["contour_peak_um"] == 0.5
        assert entry["reductions_percent"]["LWC"]["peak"] == pytest.approx(97.5)
        assert "WFC_single" in entry["reductions_percent"]
    assert whole["rivals"] == [{"name": "observer"}]
