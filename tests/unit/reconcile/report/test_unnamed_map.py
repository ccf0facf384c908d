"""A force over two coordinates is drawn as a heat map, each cell with its interval."""

from typing import Any

import pytest

from reconcile.report.unnamed_curve import curve_as_text, unnamed_curve
from reconcile.report.unnamed_map import map_as_text, unnamed_map


def finding(place: str = "m", speed: str = "m/s") -> dict[str, Any]:
    parameters: dict[str, Any] = {}
    for number in (1, 2, 3):
        parameters[f"at_{number}"] = {"value": 0.01 * number, "ci95": [0.0, 0.0], "unit": place}
    for number in (1, 2):
        parameters[f"at_velocity_{number}"] = {"value": 0.05 * number, "ci95": [0.0, 0.0], "unit": speed}
    for row in (1, 2, 3):
        for column in (1, 2):
            height = 2.0 * row - 3.0 * column
            parameters[f"height_{row}_{column}"] = {"value": height, "ci95": [height - 1.0, height + 0.5]}
    over = "position_and_velocity"
    return {"effect": "unknown", "over": over, "where": {"sensor": "force"}, "parameters": parameters}


def test_the_heat_map_has_velocities_upwards_and_an_interval_in_each_cell() -> None:
    figure = unnamed_map(finding())
    assert figure is not None
    [cells] = figure.data
    assert cells["x"] == pytest.approx([10.0, 20.0, 30.0])
    assert cells["y"] == pytest.approx([50.0, 100.0])
    assert cells["z"] == [[-1.0, 1.0, 3.0], [-4.0, -2.0, 0.0]]
    assert cells["text"][1][0] == "-5 to -3.5"
    titles = [figure.layout[name]["title"]["text"] for name in ("xaxis", "yaxis")]
    assert titles == ["position (mm)", "velocity (mm/s)"]


def test_a_joint_has_a_torque_and_the_terminal_a_line() -> None:
    assert "from -4 to 3 N m" in map_as_text(finding("rad", "rad/s"))
    assert "from -4 to 3 N (" in map_as_text(finding())


def test_curves_and_maps_are_told_apart() -> None:
    assert unnamed_curve(finding()) is None
    assert curve_as_text(finding()) == ""
    assert unnamed_map({**finding(), "over": "position"}) is None
    assert map_as_text({**finding(), "over": "position"}) == ""
