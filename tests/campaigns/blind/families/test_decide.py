"""Verdicts are decided again as by the engine; rules are fitted to several cases, not to one."""

import copy
import json
from pathlib import Path

import pytest

from tests.campaigns.blind.families.decide import Rules, confidence, decided, is_unexplained, widened
from tests.campaigns.blind.families.fit import fitted, worth
from tests.campaigns.blind.families.score import Row, scores_of

ROWS: list[Row] = json.loads(
    (Path(__file__).parents[4] / "docs/blind_families_training.json").read_text(encoding="utf-8")
)["rows"]
GOOD = [row for row in ROWS if "error" not in row]


def test_the_first_rules_of_the_engine_still_name_the_same_effects() -> None:
    for row in GOOD:
        said = sorted(one["effect"] for one in row["evidence"]["findings"] if one["effect"] != "unknown")
        again = decided(row["evidence"], Rules())["findings"]
        assert sorted(one["effect"] for one in again if one["effect"] != "unknown") == said, row["seed"]


def test_a_confidence_is_the_engines() -> None:
    compared = 0
    for row in GOOD:
        for one in row["evidence"]["findings"]:
            # a curve that bears a law's name keeps the confidence of the curve
            if one["effect"] != "unknown" and not one["over"]:
                # the engine bounds it by how much was held out
                assert confidence(one, Rules()) >= one["confidence"] - 1e-4
                compared += abs(confidence(one, Rules()) - one["confidence"]) < 1e-3
    assert compared > 10


def case(effect: str, gain: float, *, false: bool) -> Row:
    finding = {"axis": "x", "effect": effect, "over": "", "confidence": 0.9, "equivalent": [], "share": gain}
    finding |= {"gain": gain, "heldout_gain": gain, "sensor": "force", "best_rival": 0.0, "parameters": {}}
    parts = {"noise": {"rms": 1.0}, "unexplained": {"rms": 0.0}, effect: {"rms": 5.0}}
    sizes = {"measured": 100.0, "parts": parts, "left": 1.0, "matters": 1.0, "is_noise": True}
    fit = {"refitted": {"train": 10.0, "heldout": 10.0}}
    concealed = {"name": effect, "parameters": {}, "also": [], "alike": [], "observable": True}
    truth = {"family": "f", "seed": 1, "kind": "quiet" if false else "single", "clutter": [], "foreign": None}
    evidence = {"verdict": "effects", "findings": [finding], "colour": {"x": {"force": 100.0}}}
    evidence |= {"accounted": {"x": {"force": sizes}}, "fit": {"x": {"force": fit}}}
    return {"truth": truth | {"effects": [] if false else [concealed]}, "evidence": evidence}


def test_one_false_name_moves_no_threshold_and_three_do() -> None:
    right = [case("cogging", 0.6, false=False) for _ in range(5)]
    false = [case("backlash", 0.12, false=True) for _ in range(3)]
    assert fitted(right + false[:1], Rules()).least_gain == Rules().least_gain
    rules = fitted(right + false, Rules())
    assert rules.least_gain == 0.15
    assert worth(scores_of(right + false, rules)) == 5


def test_what_is_left_is_unknown_from_three_conditions_on() -> None:
    evidence = case("cogging", 0.6, false=False)["evidence"]
    assert not is_unexplained(evidence, Rules())
    evidence["accounted"]["x"]["force"]["left"] = 6.0
    assert is_unexplained(evidence, Rules())
    assert decided(evidence, Rules())["findings"][-1]["effect"] == "unknown"
    white = copy.deepcopy(evidence)
    white["colour"]["x"]["force"] = 1.0
    assert not is_unexplained(white, Rules())
    assert not is_unexplained(evidence, Rules(left_share=0.5))
    assert is_unexplained(evidence, Rules(left_share=0.5, far_floors=5.0))
    constant = copy.deepcopy(evidence)  # of 10 N without any effect, 9 N are constant
    constant["accounted"]["x"]["force"]["parts"]["constant_force"] = {"rms": 9.0}
    assert is_unexplained(constant, Rules(left_share=0.5))


def test_an_interval_is_widened_about_its_value() -> None:
    [wide] = widened({"a": {"value": 2.0, "ci95": [1.0, 4.0]}}, 2.0).values()
    assert wide["ci95"] == pytest.approx([0.0, 6.0])
