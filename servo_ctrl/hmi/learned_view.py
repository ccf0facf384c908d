"""Learned functions and their versions as the Friction page shows them, as plain values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from servo_ctrl.hmi.palette import lines
from servo_ctrl.hmi.plot_frame import figure_of, layout_of
from servo_ctrl.learning.pulse_functions import table
from servo_ctrl.learning.types import Learned

if TYPE_CHECKING:
    from collections.abc import Sequence

    from servo_ctrl.config.local_status import LearnedState
    from servo_ctrl.hmi.units import Units
    from servo_ctrl.telemetry.learned_store import VersionEntry

ARROW = "\N{RIGHTWARDS ARROW}"
SCREW_NODES = 2
"""Least number of points of a screw that can be drawn."""


class Drawn(NamedTuple):
    """Learned functions under the name they have in the plot."""

    label: str
    learned: Learned


class VersionRow(NamedTuple):
    """A version in the store, ready to be shown."""

    version: int
    in_use: bool
    learned_at: str
    learner: str
    strokes: str
    gain: str
    """J before and after."""
    problem: str
    """Why it cannot be used; "" when it can."""


def from_state(state: LearnedState) -> Learned:
    """What the machine says it uses, as learning knows it."""
    return Learned(
        learner=state.learner,
        durations=state.durations,
        amplitudes=state.amplitudes,
        spread_m_s2=state.spread_m_s2 or 0.0,
        trailing=state.trailing,
        before_m=state.before_m or 0.0,
        after_m=state.after_m or 0.0,
        strokes=state.strokes,
        machine_time_s=state.machine_time_s or 0.0,
    )


def duration_figure(drawn: Sequence[Drawn], units: Units, *, dark: bool) -> dict[str, Any]:
    """T*(a) as the control law reads it, with the learned points."""
    return _functions(drawn, "durations", 1e3, "duration T* (ms)", units, dark=dark)


def amplitude_figure(drawn: Sequence[Drawn], units: Units, *, dark: bool) -> dict[str, Any]:
    """A*(a) likewise."""
    scale = units.velocity
    return _functions(drawn, "amplitudes", scale.factor, f"amplitude A* ({scale.unit})", units, dark=dark)


def screw_figure(
    points: Sequence[tuple[float, float, float]], units: Units, *, dark: bool
) -> dict[str, Any] | None:
    """Error of the screw and lost motion over the travel; None where there is no table."""
    if len(points) < SCREW_NODES:
        return None
    colours = lines(dark=dark)
    x = [point[0] * units.length.factor for point in points]
    names = ("scale less encoder", "lost motion")
    data = [
        {
            "type": "scatter",
            "mode": "lines",
            "name": name,
            "x": x,
            "y": [point[column] * units.error.factor for point in points],
            "line": {"color": colours[column - 1], "dash": dash},
        }
        for column, name, dash in zip((1, 2), names, ("solid", "dash"), strict=True)
    ]
    layout = layout_of(f"position ({units.length.unit})", units.error.unit, dark=dark)
    return figure_of(data, layout, revision=units.name)


def version_rows(entries: Sequence[VersionEntry], units: Units) -> list[VersionRow]:
    """The versions of an axis, the newest first."""
    rows = []
    for entry in reversed(entries):
        if entry.result is None:
            rows.append(VersionRow(entry.version, entry.in_use, "", "", "", "", entry.problem))
            continue
        learned, error = entry.result.learned, units.error
        rows.append(
            VersionRow(
                entry.version,
                entry.in_use,
                f"{entry.result.learned_at[:16].replace('T', ' ')} UTC",
                learned.learner,
                str(learned.strokes),
                f"{error.text(learned.before_m)} {ARROW} {error.with_unit(learned.after_m)}",
                entry.problem,
            )
        )
    return rows


def before_use(entries: Sequence[VersionEntry]) -> int | None:
    """The version that rolling back takes into use: 0 = none; None where none is in use to go back from."""
    in_use = next((entry.version for entry in entries if entry.in_use), None)
    if in_use is None:
        return None
    sound = [entry.version for entry in entries if entry.version < in_use and not entry.problem]
    return max(sound, default=0)


def _functions(
    drawn: Sequence[Drawn], part: str, factor: float, name: str, units: Units, *, dark: bool
) -> dict[str, Any]:
    colours, scale = lines(dark=dark), units.acceleration
    data: list[dict[str, Any]] = []
    for place, (label, learned) in enumerate(drawn):
        colour, dash = colours[place % len(colours)], ("solid", "dash")[place % 2]
        rows = table(learned)
        curve = rows[1] if part == "durations" else rows[2]
        points = np.array(getattr(learned, part))
        of = {"type": "scatter", "legendgroup": label, "name": label}
        data += [
            of
            | {
                "mode": "lines",
                "x": (rows[0] * scale.factor).tolist(),
                "y": (curve * factor).tolist(),
                "line": {"color": colour, "dash": dash},
            },
            of
            | {
                "mode": "markers",
                "showlegend": False,
                "x": (points[:, 0] * scale.factor).tolist(),
                "y": (points[:, 1] * factor).tolist(),
                "marker": {"color": colour, "size": 8, "symbol": ("circle", "square-open")[place % 2]},
            },
        ]
    layout = layout_of(f"reverse acceleration a ({scale.unit})", name, dark=dark)
    layout["xaxis"]["type"] = "log"
    layout["yaxis"]["rangemode"] = "tozero"
    return figure_of(data, layout, revision=units.name)
