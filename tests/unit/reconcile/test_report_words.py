"""The verdict in words: readable units, a sentence for each answer, what to do."""

from __future__ import annotations

import io
from typing import Any

import pytest
from rich.console import Console

from reconcile.report_console import show
from reconcile.report_words import headline, interval, parameter_names, percent, quantity

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
        "not_observable": [],
    }


@pytest.mark.parametrize(
    ("value", "unit", "told"),
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
def test_quantities_are_in_units_that_one_reads(value: float, unit: str, told: str) -> None:
    assert quantity(value, unit) == told


def test_an_interval_is_in_the_unit_of_its_value() -> None:
    assert interval(PLAY["parameters"]["play_m"]) == "3.02 µm (2.9 to 3.1)"
    sharp = {"value": 3.00021e-6, "ci95": [2.9998e-6, 3.0006e-6], "unit": "m"}
    assert interval(sharp) == "3.0002 µm (2.9998 to 3.0006)"


def test_two_parameters_of_one_name_are_told_apart() -> None:
    given = {"stribeck_n": {"unit": "N"}, "stribeck_m_s": {"unit": "m/s"}, "play_m": {"unit": "m"}}
    names = parameter_names(given)
    assert len(set(names.values())) == 3
    assert names["play_m"] == "play"


def test_nothing_is_certain() -> None:
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


def test_what_is_real_but_unknown_is_told_beside_the_effects() -> None:
    said = headline(verdict("effects", PLAY, {**PLAY, "effect": "unknown"}))
    assert said.sentence.startswith("The model leaves out one effect: backlash on axis x")
    assert "no effect of the catalogue explains" in said.sentence


def test_the_terminal_shows_it_all_and_reads_no_markup() -> None:
    stream = io.StringIO()
    show(verdict("effects", PLAY), Console(file=stream, width=100))
    shown = stream.getvalue()
    assert "verdict: effects" in shown
    assert "[bold]3 um[/bold]" in shown
    assert "3.02 µm (2.9 to 3.1)" in shown
    assert "1.1 N" in shown
