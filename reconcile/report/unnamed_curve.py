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

    at: Array
    at_unit: str
    height: Array
    low: Array
    high: Array
    unit: str
    what: str
    """Quantity of the height: force, mass, deviation."""
    name: str
    """Display name of the coordinate."""
    turns: bool
    """The height changes sign with the direction of motion."""


def unnamed_curve(finding: Mapping[str, Any]) -> Figure | None:
    """Return the picture of a finding; None where it is no curve over a coordinate."""
    table = _table(finding)
    if table is None:
        return None
    turned = " times direction" if table.turns else ""
    drawing = layout(f"{table.name} ({table.at_unit})", f"{table.what}{turned} ({table.unit})")
    if table.at[0] > 0.0 and table.at[-1] > LOGARITHMIC_RATIO * table.at[0]:
        drawing["xaxis"].update(LOGARITHMIC)
    found = line("after", table.at, table.height, name="found")
    found["mode"] = "lines+markers"
    data = [*_band(table.at, table.low, table.high), found]
    note = "Above its mean, between the points straight. Grey band: 95 % of what resampled blocks give."
    note += " Its sign turns with the direction of motion." if table.turns else ""
    return Figure("curve", f"{table.what.capitalize()} over the {table.name}", note, data, drawing)


def curve_in_words(finding: Mapping[str, Any]) -> str:
    """Return the curve of a finding as a line of text; empty where it is no curve."""
    table = _table(finding)
    if table is None:
        return ""
    heights = ", ".join(f"{height:.3g}" for height in table.height)
    turned = " times direction" if table.turns else ""
    return (
        f"{table.what}{turned} from {table.at[0]:.3g} to {table.at[-1]:.3g} {table.at_unit}: "
        f"{heights} {table.unit} (the report draws it)"
    )


def _table(finding: Mapping[str, Any]) -> _Table | None:
    parameters, over = finding["parameters"], finding.get("over", "")
    numbers = [key.removeprefix("at_") for key in parameters if key.startswith("at_")]
    if not over or not numbers or any(f"height_{number}" not in parameters for number in numbers):
        return None
    at = np.array([parameters[f"at_{number}"]["value"] for number in numbers])
    heights = [parameters[f"height_{number}"] for number in numbers]
    low, high = np.array([one["ci95"] for one in heights]).T
    unit = _height_unit(finding, over)
    at_size, at_unit = display_unit(parameters[f"at_{numbers[0]}"]["unit"], float(np.abs(at).max()))
    size, shown_unit = display_unit(unit, float(np.abs([low, high]).max()))
    return _Table(
        at=at / at_size,
        at_unit=at_unit,
        height=np.array([one["value"] for one in heights]) / size,
        low=low / size,
        high=high / size,
        unit=shown_unit,
        what="mass" if over in MASSES else "force" if unit in {"N", "N m"} else "deviation",
        name=display_name(over.removesuffix(SUFFIX).removesuffix("_of_the_mass")),
        turns=over in BY_DIRECTION or over.endswith(SUFFIX),
    )


def _band(x: Array, low: Array, high: Array) -> list[dict[str, Any]]:
    """Return two lines without width and the filled area between them."""
    edge = {"type": "scatter", "mode": "lines", "x": packed(x), "line": {"width": 0}, "hoverinfo": "skip"}
    upper = {**edge, "y": packed(high), "showlegend": False}
    lower = {**edge, "y": packed(low), "fill": "tonexty", "fillcolor": "--floor-band", "name": "95 % band"}
    return [upper, lower]


def _height_unit(finding: Mapping[str, Any], over: str) -> str:
    rotary = any(one["unit"].startswith("rad") for one in finding["parameters"].values())
    if over in MASSES:
        return "kg m^2" if rotary else "kg"
    if finding["where"]["sensor"] == "deviation":
        return "rad" if rotary else "m"
    return "N m" if rotary else "N"
