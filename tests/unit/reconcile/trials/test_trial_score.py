"""Scores of synthetic verdicts: right, neutral and false names."""

from typing import Any

import pytest

from reconcile.trials.score import score
from reconcile.trials.summary import summary, wilson

SENSING = {"has_scale": True, "has_temperature": False, "is_command": False}


def effect(name: str, **given: Any) -> dict[str, Any]:
    plain = {
        "name": name,
        "parameters": {},
        "catalogue": True,
        "also": (),
        "alike": (),
        "deviation": False,
        "observable": True,
        "why_not": "",
        "rms": 1.0,
        "share": 0.5,
    }
    return plain | given


def truth(*effects: dict[str, Any], kind: str = "single", **clutter: float) -> dict[str, Any]:
    return {
        "effects": list(effects),
        "clutter": clutter or {"presliding_hysteresis": 0.2, "cogging": 0.1},
        "kind": kind,
        "production": False,
        "sensing": SENSING,
        "nominal": "fitted",
        "runs": [1],
    }


def verdict(*names: str, word: str = "effects", **parameters: Any) -> dict[str, Any]:
    return {
        "verdict": word,
        "findings": [
            {
                "effect": name,
                "axis": "x",
                "confidence": 0.9,
                "equivalent": ["asymmetric_coulomb_friction"] if name == "constant_force" else [],
                "heldout_gain": 0.1,
                "parameters": parameters,
            }
            for name in names
        ],
    }


@pytest.mark.parametrize(
    ("names", "first", "false"),
    [
        (("stribeck_friction",), "right", []),
        (("presliding_hysteresis", "stribeck_friction"), "clutter", []),
        (("backlash", "stribeck_friction"), "backlash", ["backlash"]),
        (("unknown",), "unknown", []),
        ((), "nothing", []),
    ],
)
def test_the_first_name_is_scored(names: tuple[str, ...], first: str, false: list[str]) -> None:
    row = score(truth(effect("stribeck_friction")), verdict(*names))
    assert (row["first"], row["false"]) == (first, false)


def test_clutter_that_is_larger_than_the_effect_may_come_first() -> None:
    concealed = truth(effect("stribeck_friction", rms=0.15), presliding_hysteresis=0.2)
    assert score(concealed, verdict("presliding_hysteresis", "stribeck_friction"))["first"] == "right"


def test_a_name_of_the_same_class_counts_as_right() -> None:
    concealed = truth(effect("asymmetric_coulomb_friction", alike=("constant_force",)))
    assert score(concealed, verdict("constant_force"))["first"] == "class"


def test_invisible_effects_count_neither_as_expected_nor_as_false() -> None:
    hidden = effect("backlash", observable=False, why_not="no scale", also=("drive_compliance",))
    row = score(truth(hidden), verdict("backlash"))
    assert (row["first"], row["found"], row["false"]) == ("", [], [])


def test_physics_outside_the_catalogue_counts_as_unknown() -> None:
    foreign = truth(effect("viscoelastic_relaxation", catalogue=False), kind="foreign")
    assert score(foreign, verdict("unknown", word="unknown"))["called_unknown"]
    named = score(foreign, verdict("stribeck_friction"))
    assert (named["called_unknown"], named["false"]) == (False, ["stribeck_friction"])


def test_parameters_are_compared_part_by_part() -> None:
    concealed = truth(effect("cogging", parameters={"harmonic": 2.0, "amplitude": 3.0}))

    def of(value: float, half: float = 0.1) -> dict[str, Any]:
        return {"value": value, "ci95": [value - half, value + half], "unit": ""}

    parts = {"harmonic_1": of(6.0), "amplitude_1": of(1.0), "harmonic_2": of(2.0), "amplitude_2": of(3.05)}
    [entry] = score(concealed, verdict("cogging", **parts))["parameters"]
    assert entry["covered"]
    assert entry["error"] == pytest.approx(0.05 / 3.0)


def test_the_interval_of_a_share_is_wilsons() -> None:
    assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)  # Newcombe (1998)'s method 3
    assert wilson(0, 0) == (0.0, 1.0)


def test_a_summary_counts_each_case_where_it_belongs() -> None:
    rows = [
        score(truth(effect("stribeck_friction")), verdict("stribeck_friction")),
        score(truth(effect("stribeck_friction")), verdict("backlash")),
        score(truth(effect("backlash", observable=False)), verdict()),
        score(truth(kind="none"), verdict("cogging")),
        score(truth(kind="none"), verdict("torque_ripple")),
    ]
    rows = [row | {"seconds": 1.0, "achieved": {}, "seed": n} for n, row in enumerate(rows)]
    scores = summary(rows)["scores"]
    assert (scores["right_first_name"]["value"], scores["right_first_name"]["of"]) == (0.5, 2)
    assert (scores["false_names_quiet"]["value"], scores["false_names_quiet"]["of"]) == (0.5, 2)
