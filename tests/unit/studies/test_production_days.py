"""Production with temperature in the batch twin: its motion, and what a level over temperature does."""

from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.config.load import load_machine
from servo_ctrl.learning import waveform_run
from studies.feng_2015 import production_days
from studies.feng_2015.production_days import RADIUS_M, REVERSALS, Batch, part, produce
from studies.feng_2015.temperature_tables import aims, by_course
from studies.feng_2015.waveform_learning import learn_waveforms
from studies.feng_2015.waveform_temperature import at_the_guide, drawn_table, figures_um, stuck
from twin.plant_file import load_plant

XY_TABLE = Path(__file__).parents[3] / "machines" / "xy_table"
T = 1e-3


@pytest.mark.parametrize("feed_m_s", production_days.FEEDS_M_S)
def test_a_part_is_one_motion_from_rest_to_rest(feed_m_s: float) -> None:
    commands, starts = part(feed_m_s, T)
    position_m, velocity_m_s, acceleration_m_s2 = commands[:, :3].T
    assert len(starts) == REVERSALS
    assert np.abs(position_m[starts]) == pytest.approx(RADIUS_M, rel=1e-3)
    assert commands[[0, -1], 0] == pytest.approx(0.0, abs=1e-7)
    assert commands[[0, -1], 1] == pytest.approx(0.0, abs=1e-6)
    assert np.diff(position_m) == pytest.approx(velocity_m_s[1:] * T, abs=1e-6)
    assert np.gradient(velocity_m_s, T) == pytest.approx(acceleration_m_s2, abs=2e-2)
    assert np.abs(acceleration_m_s2[starts]) == pytest.approx(feed_m_s**2 / RADIUS_M, rel=1e-3)


def test_a_cold_start_is_right_with_a_sensor_and_one_that_sticks_is_no_harm(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(waveform_run, "ACCELERATIONS", 5)
    monkeypatch.setattr(waveform_run, "ITERATIONS", 5)
    batches = (Batch(6, 120.0), Batch(2, 200.0), Batch(2, 0.0))
    monkeypatch.setattr(production_days, "DAYS", (batches, (Batch(2, 0.0),)))
    machine, table = load_machine(XY_TABLE), drawn_table(load_plant(XY_TABLE), 1)
    learned = learn_waveforms(machine, table.plant, table.axis).learned
    alone, scheduled, still = (
        figures_um(produce(machine, table.plant, table.axis, learned, *thermometer))
        for thermometer in ((), (at_the_guide(1),), (stuck,))
    )
    assert scheduled["cold_start"] < 0.6 * alone["cold_start"]
    assert scheduled["all"] < alone["all"]
    assert still["all"] < 1.25 * alone["all"] + 0.1


def figures(schedule_um: float, misleading_um: float) -> dict[str, object]:
    groups = ("cold_start", "warm_up", "behind_pauses", "all")
    values = {"adaptation": 1.0, "schedule": schedule_um, "misleading": misleading_um}
    table = {"J_um": {name: dict.fromkeys(groups, value) for name, value in values.items()}}
    return {"warming": [table], "constant": [table]}


def test_an_aim_is_missed_where_a_table_is_beyond_its_bound() -> None:
    met = [met for _, _, met in aims(figures(0.4, 1.3))]
    assert met == [True, True, True, True, True, True, True]
    rows = list(aims(figures(0.6, 1.5)))
    assert [met for _, _, met in rows] == [False, False, False, True, False, True, False]
    assert rows[4][1] == "1 of 1 above, worst 0.50 um more"
    assert "| changes with temperature | adaptation alone | 1.00, 1.00 |" in by_course(figures(0.4, 1.0))
