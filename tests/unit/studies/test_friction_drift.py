"""Figures and picture of the study of changing friction, from a synthetic log."""

from pathlib import Path

import pytest
from friction_results import learned

from servo_ctrl.hil_rig.simulated_run import RunError
from studies.feng_2015.drift import Drift, Instants, change_s, drift_figures
from studies.feng_2015.drift_run import _draw

MACHINES = Path(__file__).parents[3] / "machines"


def story() -> Drift:
    """J of x is 1 um, from 60 s on 6 um, from 200 s on 2 um; y's is 9 um throughout."""
    levels = [
        (10, 1.0),
        (20, 1.0),
        (61, 6.0),
        (70, 6.0),
        (75, 6.2),
        (80, 6.4),
        (210, 2.0),
        (220, 2.2),
        (230, 2.0),
    ]
    log = [
        {
            "axis": axis,
            "time_s": float(t),
            "error_mean_m": (j if axis == "x" else 9.0) * 1e-6,
            "due": 70 <= t < 215,
        }
        for t, j in levels
        for axis in ("x", "y")
    ]
    return Drift(Instants(60.0, 70.0, 100.0, 200.0, 220.0), 4e-6, log, learned(), 2, ["learning is due"])


def test_j_of_each_part_is_the_median_of_the_changing_axis_alone() -> None:
    assert story().parts_m() == pytest.approx(
        {"compensated": 1e-6, "friction changed": 6.2e-6, "learned again": 2e-6}
    )


def test_a_part_without_reversals_is_named() -> None:
    with pytest.raises(RunError, match=r"no reversal of x between 81\.0 s and 99\.0 s"):
        story().evaluation_m(81.0, 99.0)


def test_the_json_has_every_reversal_and_the_instants() -> None:
    figures = drift_figures(story())
    assert len(figures["reversals"]) == 18
    assert figures["reversals"][4] == {"axis": "x", "time_s": 61.0, "J_um": pytest.approx(6.0), "due": False}
    assert figures["J_um"]["friction changed"] > figures["J_required_um"] > figures["J_um"]["learned again"]
    assert list(figures["instants"].values()) == [60.0, 70.0, 100.0, 200.0, 220.0]


def test_the_picture_is_drawn(tmp_path: Path) -> None:
    _draw(tmp_path / "drift.png", story())
    assert (tmp_path / "drift.png").stat().st_size > 10_000


def test_the_instant_of_change_comes_from_the_plant_file(tmp_path: Path) -> None:
    assert change_s(MACHINES / "xy_table" / "plant_lubrication_loss.toml") == 60.0
    with pytest.raises(RunError, match=r"plant\.toml: no axis\.x\.lubrication_loss\.start_s"):
        change_s(MACHINES / "xy_table" / "plant.toml")
    with pytest.raises(RunError, match=r"absent\.toml"):
        change_s(tmp_path / "absent.toml")
