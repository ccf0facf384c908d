"""The text of the verdict: readable units, a sentence for each verdict, advice."""

import io
from typing import Any

import pytest
from rich.console import Console

from reconcile.report.console import show
from reconcile.report.experiment_text import paragraph
from reconcile.report.words import headline, interval, parameter_names, percent, quantity

FIT = {
    "x": {
        "force": {
            "unit": "N",
            "before": {"train": 2.0, "heldout": 2.5},
            "refitted": {"train": 2.0, "heldout": 2.4},
            "after": {"train": 1.0, "heldout": 1.1},
        }
    }
}
PLAY = {
    "axis": "x",
    "effect": "backlash",
    "confidence": 0.9999,
    "equivalent": [],
    "parameters": {"play_m": {"value": 3.02e-6, "ci95": [2.9e-6, 3.1e-6], "unit": "m"}},
    "explanation": "the scale steps [bold]3 um[/bold]",
    "heldout_gain": 0.5,
}


def verdict(word: str, *findings: dict[str, Any]) -> dict[str, Any]:
    located = [{"axis": "x", "coordinate": "run_time", "share": 0.4}]
    return {
        "verdict": word,
        "findings": list(findings),
        "located": located,
        "fit": FIT,
        "notes": [],
        "minor": [],
        "next_experiment": {},
        "not_observable": [],
    }


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (3.02e-6, "m", "3.02 µm"),
        (-0.025, "m", "-25 mm"),
        (5e-9, "m", "5 nm"),
        (0.0, "m", "0 m"),
        (3.5e-4, "s", "350 µs"),
        (2.8e-2, "m/s", "28 mm/s"),
        (5e7, "N/m", "50 N/µm"),
        (-38.8, "N s/m", "-38.8 N s/m"),
        (2.0, "N s^2/m^2", "2 N s²/m²"),
        (0.03, "", "0.03"),
    ],
)
def test_quantities_are_in_readable_units(value: float, unit: str, text: str) -> None:
    assert quantity(value, unit) == text


def test_an_interval_is_in_the_unit_of_its_value() -> None:
    assert interval(PLAY["parameters"]["play_m"]) == "3.02 µm (2.9 to 3.1)"
    sharp = {"value": 3.00021e-6, "ci95": [2.9998e-6, 3.0006e-6], "unit": "m"}
    assert interval(sharp) == "3.0002 µm (2.9998 to 3.0006)"


def test_two_parameters_of_one_name_are_distinguished() -> None:
    given = {"stribeck_n": {"unit": "N"}, "stribeck_m_s": {"unit": "m/s"}, "play_m": {"unit": "m"}}
    names = parameter_names(given)
    assert len(set(names.values())) == 3
    assert names["play_m"] == "play"


def test_no_probability_is_shown_as_certain() -> None:
    assert [percent(p) for p in (1.0, 0.97, 0.001, 0.0)] == ["> 99 %", "97 %", "< 1 %", "0 %"]


def test_each_answer_has_its_sentence_and_what_to_do() -> None:
    effects = headline(
        verdict("effects", PLAY, {**PLAY, "effect": "cogging", "equivalent": ["torque_ripple"]})
    )
    assert effects.sentence == "The model leaves out 2 effects: backlash on axis x and cogging on axis x."
    assert "model.toml" in effects.advice
    assert "from 2.5 to 1.1 N" in effects.advice
    assert "torque ripple" in effects.advice
    assert "values" in headline(verdict("parameters")).sentence
    assert "noise" in headline(verdict("consistent")).sentence
    unknown = headline(verdict("unknown", {**PLAY, "effect": "unknown"}))
    assert "no effect of the catalogue" in unknown.sentence
    assert "run time" in unknown.advice


def test_an_unnamed_term_is_reported_beside_the_effects() -> None:
    found = headline(verdict("effects", PLAY, {**PLAY, "effect": "unknown"}))
    assert found.sentence.startswith("The model leaves out one effect: backlash on axis x")
    assert "no effect of the catalogue explains" in found.sentence


FOLLOWING = {
    "why": "these recordings cannot tell cogging from torque ripple",
    "separates": ["cogging", "torque_ripple"],
    "axis": "x",
    "motion": "several accelerations over the same places",
    "from_mm": -20.0,
    "to_mm": 20.5,
    "accelerations_mm_s2": [100.0, 300.0, 1000.0],
    "directions": "both",
    "times": 5,
    "record_too": "temperature",
    "tells": "only a ripple grows with the force",
}


def test_the_next_experiment_is_a_paragraph_with_its_numbers() -> None:
    assert paragraph(FOLLOWING) == (
        "These recordings cannot tell cogging from torque ripple. On axis x, record several accelerations "
        "over the same places (from -20 mm; to 20.5 mm; accelerations 100, 300 and 1000 mm/s²; directions: "
        "both; 5 times; recorded too: temperature). That decides between cogging and torque ripple: only a "
        "ripple grows with the force."
    )
    unknown = {**FOLLOWING, "separates": ["unknown"], "tells": "whether it changes with the speed"}
    assert paragraph(unknown).endswith("That shows whether it changes with the speed.")
    assert paragraph({}) == ""


def test_every_number_of_an_experiment_has_its_unit() -> None:
    keys = {"speeds_mm_s": "mm/s", "strokes_um": "µm", "frequency_hz": "Hz", "hold_s": "s", "forces_n": "N"}
    for key, unit in keys.items():
        assert f"({key.partition('_')[0]} 1.5 and 2 {unit})" in paragraph(
            {name: FOLLOWING[name] for name in ("why", "separates", "axis", "motion", "tells")}
            | {key: [1.5, 2.0]}
        )


def test_the_terminal_shows_the_report_without_interpreting_markup() -> None:
    stream = io.StringIO()
    found = verdict("effects", PLAY)
    replay = {
        "recording": "[bold]run.csv",
        "force_error": {"before": 0.0743, "after": 0.0227},
        "motor_rms_m": {"before": 2.82e-6, "after": 7.7e-7},
    }
    found["fit"] = {"x": {**FIT["x"], "replay": [replay]}}
    found["minor"] = [{"axis": "x", "effect": "cogging", "heldout_gain": 0.004, "confidence": 0.6}]
    found["next_experiment"] = FOLLOWING
    show(found, Console(file=stream, width=1000))
    shown = stream.getvalue()
    assert (
        "closed-loop replay of [bold]run.csv: force error 7.43 -> 2.27 %, position 2.82 µm -> 770 nm" in shown
    )
    assert "too doubtful to be named: cogging (axis x, confidence 60 %, worth < 1 %)." in shown
    assert f"next experiment: {paragraph(FOLLOWING)}" in shown
    assert "verdict: effects" in shown
    assert "[bold]3 um[/bold]" in shown
    assert "3.02 µm (2.9 to 3.1)" in shown
    assert "1.1 N" in shown


def test_what_is_left_above_the_noise_is_not_called_noise() -> None:
    sizes = {"unit": "N", "parts": {"unexplained": {"rms": 1.6, "share": 0.01}}, "unexplained_floors": 4.6}
    agreeing = verdict("consistent") | {"accounted": {"x": {"force": {**sizes, "is_noise": False}}}}
    told = headline(agreeing)
    assert told.sentence == "Model and recordings agree: the residual cannot be told from noise."
    assert "1.6 N RMS remain unexplained, 4.6 noise floors" in told.advice
    agreeing["accounted"]["x"]["force"]["is_noise"] = True
    assert "is noise, or negligible" in headline(agreeing).sentence
