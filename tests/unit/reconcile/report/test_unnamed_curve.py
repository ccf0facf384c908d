"""A term without a name is drawn as its curve with a band, in the units of the axis."""

import base64
from typing import Any

import numpy as np
import pytest

from reconcile.report.unnamed_curve import curve_as_text, unnamed_curve


def finding(over: str, unit: str, at: list[float], sensor: str = "force") -> dict[str, Any]:
    parameters: dict[str, Any] = {}
    for number, place in enumerate(at, start=1):
        height = 2.0 * number - 5.0
        parameters[f"at_{number}"] = {"value": place, "ci95": [place, place], "unit": unit}
        parameters[f"height_{number}"] = {"value": height, "ci95": [height - 1.0, height + 0.5], "unit": ""}
    return {"effect": "unknown", "over": over, "where": {"sensor": sensor}, "parameters": parameters}


def values(packed: Any) -> np.ndarray:
    if not isinstance(packed, dict):
        return np.asarray(packed, dtype=np.float64)
    return np.frombuffer(base64.b64decode(packed["bdata"]), dtype=packed["dtype"]).astype(np.float64)


def test_the_curve_has_the_heights_and_the_band_the_interval() -> None:
    figure = unnamed_curve(finding("position", "m", [-0.02, 0.0, 0.02, 0.04]))
    assert figure is not None
    upper, lower, curve = figure.data
    assert values(curve["x"]) == pytest.approx([-20.0, 0.0, 20.0, 40.0])
    assert values(curve["y"]) == pytest.approx([-3.0, -1.0, 1.0, 3.0])
    assert values(upper["y"]) == pytest.approx([-2.5, -0.5, 1.5, 3.5])
    assert values(lower["y"]) == pytest.approx([-4.0, -2.0, 0.0, 2.0])
    assert lower["fill"] == "tonexty"
    titles = [figure.layout[name]["title"]["text"] for name in ("xaxis", "yaxis")]
    assert titles == ["position (mm)", "force (N)"]


def test_logarithmic_knots_and_directions_are_in_the_text() -> None:
    figure = unnamed_curve(finding("distance_since_reversal", "m", [1e-7, 1e-5, 1e-3, 1e-2]))
    assert figure is not None
    assert figure.layout["xaxis"]["type"] == "log"
    assert figure.layout["yaxis"]["title"]["text"] == "force times direction (N)"


@pytest.mark.parametrize(
    ("over", "unit", "sensor", "words"),
    [
        ("run_time", "s", "force", "force from 0 to 30 s: -3, -1, 1, 3 N"),
        ("run_time_of_the_mass", "s", "force", "mass from 0 to 30 s: -3, -1, 1, 3 kg"),
        ("position_by_direction", "rad", "force", "force times direction from 0 to 30 rad: -3, -1, 1, 3 N m"),
        ("position", "m", "deviation", "deviation from 0 to 30 m: -3, -1, 1, 3 m"),
    ],
)
def test_the_terminal_has_a_line_of_it(over: str, unit: str, sensor: str, words: str) -> None:
    assert words in curve_as_text(finding(over, unit, [0.0, 10.0, 20.0, 30.0], sensor))


def test_what_is_no_curve_keeps_its_rows() -> None:
    ringing = {"effect": "unknown", "over": "ringing", "where": {"sensor": "force"}, "parameters": {}}
    assert unnamed_curve(ringing) is None
    assert curve_as_text({**ringing, "over": ""}) == ""
