"""An unnamed term as a picture: the identified force over its coordinate, with its 95 % band."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from kernels.readable_units import display_unit
from reconcile.report.traces import LOGARITHMIC, Figure, layout, line
from reconcile.report.words import display_name
from servo_ctrl.report.html_file import packed

MASSES = ("run_time_of_the_mass",)
"""Coordinates over which the heights are masses."""
BY_DIRECTION = ("distance_since_reversal", "speed_by_direction")
"""Coordinates beside those with SUFFIX whose heights change sign with the direction of motion."""
SUFFIX = "_by_direction"
LOGARITHMIC_RATIO = 100.0
"""Least ratio of the last knot to the first at which the knots are spaced logarithmically."""


class _Table(NamedTuple):
    """Knots and heights of a term, arrays (k,), in readable units."""

    knots: Array
    knot_unit: str
    heights: Array
    low: Array
    high: Array
    """Bounds of the 95 % interval of the heights."""
    height_unit: str
    quantity: str
    """Quantity of the height: force, mass, deviation."""
    coordinate: str
    """Display name of the coordinate."""
    by_direction: bool
    """The height changes sign with the direction of motion."""


def unnamed_curve(finding: Mapping[str, Any]) -> Figure | None:
    """Return the picture of a finding; None where it is not a curve over a coordinate."""
    table = _table(finding)
    if table is None:
        return None
    signed = " times direction" if table.by_direction else ""
    x_title = f"{table.coordinate} ({table.knot_unit})"
    figure_layout = layout(x_title, f"{table.quantity}{signed} ({table.height_unit})")
    if table.knots[0] > 0.0 and table.knots[-1] > LOGARITHMIC_RATIO * table.knots[0]:
        figure_layout["xaxis"].update(LOGARITHMIC)
    curve = line("after", table.knots, table.heights, name="found")
    curve["mode"] = "lines+markers"
    data = [*_band(table.knots, table.low, table.high), curve]
    note = "Above its mean, between the points straight. Grey band: 95 % of what resampled blocks give."
    note += " Its sign turns with the direction of motion." if table.by_direction else ""
    heading = f"{table.quantity.capitalize()} over the {table.coordinate}"
    return Figure("curve", heading, note, data, figure_layout)


def curve_as_text(finding: Mapping[str, Any]) -> str:
    """Return the curve of a finding as a line of text; empty where it is not a curve."""
    table = _table(finding)
    if table is None:
        return ""
    heights = ", ".join(f"{height:.3g}" for height in table.heights)
    signed = " times direction" if table.by_direction else ""
    return (
        f"{table.quantity}{signed} from {table.knots[0]:.3g} to {table.knots[-1]:.3g} {table.knot_unit}: "
        f"{heights} {table.height_unit} (the report draws it)"
    )


def _table(finding: Mapping[str, Any]) -> _Table | None:
    parameters, coordinate = finding["parameters"], finding.get("over", "")
    numbers = [key.removeprefix("at_") for key in parameters if key.startswith("at_")]
    if not coordinate or not numbers or any(f"height_{number}" not in parameters for number in numbers):
        return None
    knots = np.array([parameters[f"at_{number}"]["value"] for number in numbers])
    heights = [parameters[f"height_{number}"] for number in numbers]
    low, high = np.array([height["ci95"] for height in heights]).T
    si_unit = _height_unit(finding, coordinate)
    knot_factor, knot_unit = display_unit(parameters[f"at_{numbers[0]}"]["unit"], float(np.abs(knots).max()))
    factor, height_unit = display_unit(si_unit, float(np.abs([low, high]).max()))
    quantity = "force" if si_unit in {"N", "N m"} else "deviation"
    return _Table(
        knots=knots / knot_factor,
        knot_unit=knot_unit,
        heights=np.array([height["value"] for height in heights]) / factor,
        low=low / factor,
        high=high / factor,
        height_unit=height_unit,
        quantity="mass" if coordinate in MASSES else quantity,
        coordinate=display_name(coordinate.removesuffix(SUFFIX).removesuffix("_of_the_mass")),
        by_direction=coordinate in BY_DIRECTION or coordinate.endswith(SUFFIX),
    )


def _band(x: Array, low: Array, high: Array) -> list[dict[str, Any]]:
    """Return two lines without width and the filled area between them."""
    edge = {"type": "scatter", "mode": "lines", "x": packed(x), "line": {"width": 0}, "hoverinfo": "skip"}
    upper = {**edge, "y": packed(high), "showlegend": False}
    lower = {**edge, "y": packed(low), "fill": "tonexty", "fillcolor": "--floor-band", "name": "95 % band"}
    return [upper, lower]


def _height_unit(finding: Mapping[str, Any], coordinate: str) -> str:
    rotary = any(parameter["unit"].startswith("rad") for parameter in finding["parameters"].values())
    if coordinate in MASSES:
        return "kg m^2" if rotary else "kg"
    if finding["where"]["sensor"] == "deviation":
        return "rad" if rotary else "m"
    return "N m" if rotary else "N"
