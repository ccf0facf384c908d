"""verdict.json as the page reads it."""

import json
from pathlib import Path
from typing import Any

import pytest

from servo_ctrl.hmi.diagnosis.verdict import (
    ParameterValue,
    VerdictError,
    improvements,
    parameter_name,
    parameter_text,
    percent,
    read_verdict,
)

LEVELS = {"train": 2.0, "heldout": 1.0}
SENSE = {"unit": "N", "before": LEVELS, "refitted": LEVELS, "after": {"train": 1.0, "heldout": 0.25}}
FINDING = {
    "axis": "x",
    "effect": "stribeck_friction",
    "confidence": 0.97,
    "equivalent": [],
    "where": {"sensor": "force", "axis": "x"},
    "parameters": {"force_n": {"value": 2.0, "ci95": [1.9, 2.1], "unit": "N"}},
    "share": 0.5,
    "gain": 0.5,
    "heldout_gain": 0.4,
    "explanation": "friction falls",
    "runners_up": [{"effect": "backlash", "confidence": 0.01, "why_not": "less"}],
}
SMALL = {"train": 2e-9, "heldout": 8.3e-9}
VERDICT: dict[str, Any] = {
    "verdict": "effects",
    "notes": ["a note"],
    "findings": [FINDING],
    "fit": {"x": {"force": SENSE, "deviation": {**SENSE, "unit": "m", "before": SMALL}, "replay": []}},
    "located": [],
}


def written(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "verdict.json"
    file.write_text(text)
    return file


def test_a_verdict_is_read_with_its_residuals(tmp_path: Path) -> None:
    verdict = read_verdict(written(tmp_path, json.dumps(VERDICT)))
    assert verdict.findings[0].confidence == 0.97
    force, deviation = improvements(verdict)
    assert (force.levels[0], force.levels[2], force.unit) == (1.0, 0.25, "N")
    assert (deviation.levels[0], deviation.unit) == (pytest.approx(8.3), "nm")


def test_nan_and_infinity_are_unknown_values(tmp_path: Path) -> None:
    text = json.dumps(VERDICT).replace("0.97", "NaN").replace('"heldout": 0.25', '"heldout": Infinity')
    verdict = read_verdict(written(tmp_path, text))
    assert verdict.findings[0].confidence is None
    assert percent(verdict.findings[0].confidence) == "-"
    assert str(next(improvements(verdict)).levels[2]) == "nan"


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"verdict": "fine"}, "verdict"),
        ({"findings": None}, "findings"),
        ({"findings": [{**FINDING, "confidence": 2.0}]}, r"findings\.0\.confidence"),
        ({"findings": [{**FINDING, "explanation": 3}]}, "explanation"),
        ({"fit": {"x": {"force": {**SENSE, "unit": "kg"}}}}, r"fit\.x\.force\.unit"),
        ({"notes": ["x" * 5000]}, "notes"),
    ],
)
def test_an_invalid_verdict_is_refused_naming_the_key(
    tmp_path: Path, change: dict[str, Any], reason: str
) -> None:
    with pytest.raises(VerdictError, match=reason):
        read_verdict(written(tmp_path, json.dumps({**VERDICT, **change})))


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "[]", " " * 10_000_001])
def test_invalid_json_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(VerdictError, match=r"verdict\.json"):
        read_verdict(written(tmp_path, text))


def test_a_missing_verdict_is_refused(tmp_path: Path) -> None:
    with pytest.raises(VerdictError, match="cannot be read"):
        read_verdict(tmp_path / "verdict.json")


@pytest.mark.parametrize(
    ("value", "interval", "unit", "text"),
    [
        (3.02e-6, (2.95e-6, 3.1e-6), "m", "3.02 µm (2.95 to 3.1)"),
        (0.002, (0.002, 0.002), "s", "2 ms"),
        (-0.5, (-0.6, -0.4), "N", "-0.5 N (-0.6 to -0.4)"),
        (0.0, (None, None), "m", "0 m"),
        (None, (None, None), "m", "-"),
        (8.4e-9, (8.2e-9, 2.12e-8), "m/N", "8.4 nm/N (8.2 to 21.2)"),
        (1.19e8, (1.1e8, 1.2e8), "N/m", "119 N/µm (110 to 120)"),
    ],
)
def test_a_parameter_is_shown_with_a_suitable_prefix(
    value: float | None, interval: tuple[float | None, float | None], unit: str, text: str
) -> None:
    assert parameter_text(ParameterValue(value=value, ci95=interval, unit=unit)) == text


@pytest.mark.parametrize(
    ("key", "name"), [("viscous_n_s_m", "viscous"), ("play_m", "play"), ("m", "m"), ("order_2", "order 2")]
)
def test_the_name_of_a_parameter_has_no_unit(key: str, name: str) -> None:
    assert parameter_name(key) == name


def test_nothing_is_rounded_to_certainty() -> None:
    assert [percent(share) for share in (1.0, 0.97, 0.001)] == ["> 99 %", "97 %", "< 1 %"]
