"""The random precision stages: drawn within their bounds; the table of the page is read from its figures."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from studies.wang_2014.plan import AXIS
from studies.wang_2014.random_stages import OTHERS_SHARE, ROOM_K, random_stages
from studies.wang_2014.random_study import (
    COMPARED,
    CYCLES,
    MACHINE,
    SEED,
    SHAPED,
    SHAPERS,
    TRIMMED,
    commissioned,
    deviations_on,
    figures_of,
    trimmed,
)
from studies.wang_2014.random_table import over_stages, search_rows, shaper_rows
from twin.plant_file import load_plant

FIGURES = json.loads(
    (Path(__file__).parents[3] / "docs" / "positioning_random.json").read_text(encoding="utf-8")
)


def test_stages_are_drawn_within_the_class_of_the_known_one() -> None:
    plant = load_plant(MACHINE)
    own = plant.axes[AXIS].effects
    drawn = list(random_stages(plant, AXIS, 50, 7, 2))
    play_m = np.array([one.plant.axes[AXIS].effects["backlash"].play_m for one in drawn])
    assert 0.0 <= play_m.min() < 0.2 * own["backlash"].play_m
    assert 0.8 * own["backlash"].play_m < play_m.max() <= own["backlash"].play_m
    for one in drawn:
        effects = one.plant.axes[AXIS].effects
        assert (
            abs(effects["lead_error_cumulative"].relative_error)
            <= own["lead_error_cumulative"].relative_error
        )
        share = effects["structural_mode"].frequency_hz / own["structural_mode"].frequency_hz
        assert abs(share - 1.0) <= OTHERS_SHARE
        warmth = effects["thermal_expansion"]
        assert abs(warmth.ambient_k - warmth.start_k) <= ROOM_K
        assert all(0.0 < a < b <= 100.0 for a, b in pairwise(one.series.targets_mm))
    assert len({one.series.targets_mm for one in drawn}) == len(drawn)


def test_committed_figures_are_those_of_the_code() -> None:
    drawn = next(random_stages(load_plant(MACHINE), AXIS, 1, SEED, CYCLES))
    best = FIGURES["search"][0]
    setting = trimmed(best["gain"], int(best["corrections"]))
    found = figures_of(deviations_on(commissioned(drawn), drawn, setting))
    assert found == pytest.approx(FIGURES["stages"][0][TRIMMED], rel=1e-6)


def test_the_setting_is_the_cheapest_of_the_search() -> None:
    costs = [row["cost_um"] for row in FIGURES["search"]]
    assert costs == sorted(costs)
    assert len(search_rows(FIGURES).splitlines()) == 2 + len(costs)


def test_the_page_shows_the_worst_of_all_stages() -> None:
    lines = over_stages(FIGURES).splitlines()
    assert len(FIGURES["stages"]) == 20
    assert len(lines) == 2 + len(COMPARED) + 2
    for name, line in ((TRIMMED, lines[-2]), (SHAPED, lines[-1])):
        worst_um = max(stage[name]["largest_um"] for stage in FIGURES["stages"])
        assert f"{worst_um:.2f}" in line.split("|")[2]


def test_the_shaper_is_the_cheapest_of_its_search_and_the_figures_are_those_of_the_code() -> None:
    costs = [row["cost_um"] for row in FIGURES["shapers"]]
    assert costs == sorted(costs)
    assert len(shaper_rows(FIGURES).splitlines()) == 2 + len(SHAPERS)
    drawn = next(random_stages(load_plant(MACHINE), AXIS, 1, SEED, CYCLES))
    best = FIGURES["search"][0]
    setting = trimmed(best["gain"], int(best["corrections"]))._replace(shaper=FIGURES["shapers"][0]["shaper"])
    found = figures_of(deviations_on(commissioned(drawn), drawn, setting))
    assert found == pytest.approx(FIGURES["stages"][0][SHAPED], rel=1e-6)
