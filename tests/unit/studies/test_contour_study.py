"""The contour study: its committed figures are those of the code, and its tables are read from them."""

import json
from pathlib import Path

import pytest

from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from studies.feng_2015.waveform_conditions import Condition, with_period
from studies.koren_1991.contour_study import MACHINE, machines, measured, with_more_gain
from studies.koren_1991.contour_tables import by_machine, over_tables
from twin.plant_file import load_plant

FIGURES = json.loads(
    (Path(__file__).parents[3] / "docs" / "contour_control.json").read_text(encoding="utf-8")
)
KEPT = {entry["name"]: entry for entry in FIGURES["machines"]}


def test_committed_figures_are_those_of_the_code() -> None:
    machine, plant = load_machine(MACHINE), load_plant(MACHINE)
    name, mismatched = next(machines(machine))
    found = measured(Condition(name, mismatched, plant))
    assert [row["label"] for row in found["motions"]] == ["F 1000", "F 3000", "bracket.ngc"]
    for row, kept in zip(found["motions"], KEPT["kp of y -20 %"]["motions"], strict=True):
        for way in ("without", "coupled", "stiffer"):
            assert row[way] == pytest.approx(kept[way], rel=1e-6)
        assert row["coupled"]["rms_um"] < 0.6 * row["without"]["rms_um"]


def test_a_machine_that_would_be_refused_is_not_measured() -> None:
    slow = with_period(load_machine(MACHINE), 2000)
    found = measured(Condition("cycle 2 ms", slow, load_plant(MACHINE)))
    assert (found["refused"], found["motions"]) == (True, [])


def test_the_rival_has_the_gain_of_the_coupling_in_its_own_loop() -> None:
    own = axis_params(load_machine(MACHINE), "x")
    stiffer = with_more_gain(own)
    assert stiffer.position_loop.kp_1_s == own.position_loop.kp_1_s + FIGURES["gain_1_s"]


def test_tables_have_a_row_a_machine_and_a_row_a_motion() -> None:
    assert len(by_machine(FIGURES["machines"]).splitlines()) == 2 + len(KEPT)
    for key, state in (("tables", ""), ("tables_with_play", ", play 3 um")):
        assert len(over_tables(FIGURES[key], state).splitlines()) == 2 + 3
        assert len(FIGURES[key]) == 20
    assert "| cycle 2 ms | 2.54 | refused |" in by_machine(FIGURES["machines"])
