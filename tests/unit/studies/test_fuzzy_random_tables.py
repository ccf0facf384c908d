"""Fuzzy-PD on random tables: drawn within their bounds, the committed figures are those of the code."""

import json
from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.config.load import load_machine
from studies.xia_fuzzy_pd.random_figures import ROWS, over_tables
from studies.xia_fuzzy_pd.random_tables import LEAST_M, MACHINE, MOST_M, SEED, measured, random_tables
from studies.xia_fuzzy_pd.study import AXIS, CONTROLLERS
from twin.plant_file import load_plant

FIGURES = json.loads(
    (Path(__file__).parents[3] / "docs" / "fuzzy_pd_random.json").read_text(encoding="utf-8")
)


@pytest.mark.parametrize("law", CONTROLLERS)
def test_committed_figures_are_those_of_the_code(law: str) -> None:
    table = next(random_tables(load_plant(MACHINE), 1, SEED))
    found = measured(load_machine(MACHINE / CONTROLLERS[law]), table)
    assert found == pytest.approx(FIGURES["tables"][0][law], rel=1e-6)
    assert FIGURES["tables"][0]["step_mm"] == pytest.approx(table.step_m * 1e3)


def test_tables_are_drawn_on_both_sides_of_the_known_one() -> None:
    plant = load_plant(MACHINE)
    drawn = list(random_tables(plant, 60, 3))
    for value_of in (
        lambda axis: axis.motor.inertia_kg_cm2 / plant.axes[AXIS].motor.inertia_kg_cm2,
        lambda axis: axis.table.mass_kg / plant.axes[AXIS].table.mass_kg,
        lambda axis: (
            axis.effects["drive_compliance"].stiffness_n_m
            / plant.axes[AXIS].effects["drive_compliance"].stiffness_n_m
        ),
    ):
        shares = np.array([value_of(one.plant.axes[AXIS]) for one in drawn])
        assert 0.7 <= shares.min() < 0.8
        assert 1.2 < shares.max() <= 1.3
    sizes_m = np.array([one.step_m for one in drawn])
    assert LEAST_M <= sizes_m.min() < sizes_m.max() <= MOST_M


def test_the_page_shows_median_and_worst_of_every_figure() -> None:
    lines = over_tables(FIGURES).splitlines()
    assert len(FIGURES["tables"]) == 20
    assert len(lines) == 2 + len(ROWS)
    rest_um = [table["fuzzy_pd"]["rest_um"] for table in FIGURES["tables"]]
    assert f"{np.median(rest_um):.2f}, {max(rest_um):.2f} | " in lines[-1]
