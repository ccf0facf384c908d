"""What the Friction page shows of reversals and of learning, as plain values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from servo_ctrl.hmi.palette import lines
from servo_ctrl.hmi.plot_frame import figure_of, layout_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from servo_ctrl.config.local_messages import Reversal
    from servo_ctrl.config.local_status import AxisState, LearningState
    from servo_ctrl.hmi.units import Units

INDICATORS = {
    "error_mean_m": "J (mean error)",
    "error_rms_m": "error RMS",
    "error_peak_m": "error peak",
    "contour_peak_m": "contour peak",
}
"""Of Feng et al. 2015, section 5; the first is what J_required is about."""
SYMBOLS = ("circle", "square", "diamond", "triangle-up")
"""By axis: told apart without colour, too."""
GREY = 6
"""Of the colours of curves: belongs to no axis."""
DIRECTIONS = ("\N{MINUS SIGN}", "+")
"""Of the motion after a reversal."""
ACTIVE = frozenset({"running", "pausing", "paused"})
STAGES = {
    "interval": "finding the range of accelerations",
    "duration": "duration of the pulse",
    "coarse": "amplitude, coarse",
    "fine": "amplitude, fine",
    "search": "searching the pulse",
    "trailing": "second trapezoid",
    "travel": "travelling along the screw",
    "check": "checking what was learned",
}
"""What a stroke is for (`learning.types.Stroke`)."""


class Progress(NamedTuple):
    """A learning run, ready to be shown."""

    headline: str
    share: float
    """0 to 1."""
    stage: str
    strokes: str
    remaining: str
    best: str
    reason: str


class Indicator(NamedTuple):
    """The last reversal of an axis in one indicator."""

    name: str
    text: str
    above: bool
    """Above J_required; only J can be."""


def indicator_figure(
    reversals: Iterable[Reversal],
    axes: Sequence[str],
    indicator: str,
    required_m: float | None,
    period_s: float,
    units: Units,
    *,
    dark: bool,
) -> dict[str, Any]:
    """One indicator of each reversal over the time of the run; J_required where the indicator is J."""
    colours, scale = lines(dark=dark), units.error
    by_axis: dict[str, list[Reversal]] = {axis: [] for axis in axes}
    for reversal in reversals:
        by_axis.setdefault(reversal.axis, []).append(reversal)
    data: list[dict[str, Any]] = []
    for place, (axis, seen) in enumerate(by_axis.items()):
        values = [getattr(reversal.report, indicator) for reversal in seen]
        data.append(
            {
                "type": "scatter",
                "mode": "lines+markers",
                "name": f"axis {axis}",
                "x": [reversal.report.cycle * period_s for reversal in seen],
                "y": [None if value is None else value * scale.factor for value in values],
                "line": {"color": colours[place % len(colours)], "width": 1},
                "marker": {"symbol": SYMBOLS[place % len(SYMBOLS)], "size": 7},
            }
        )
    layout = layout_of("time of the run (s)", f"{INDICATORS[indicator]} ({scale.unit})", dark=dark)
    layout["yaxis"]["rangemode"] = "tozero"
    if indicator == "error_mean_m" and required_m is not None:
        layout["shapes"] = [_level(required_m * scale.factor, colours[GREY])]
        layout["annotations"] = [_words("J required", required_m * scale.factor, colours[GREY])]
    return figure_of(data, layout, revision=indicator + units.name)


def error_figure(reversals: Sequence[Reversal], units: Units, *, dark: bool) -> dict[str, Any]:
    """The error over the monitoring time of some reversals, one curve each."""
    colours = lines(dark=dark)
    data = [
        {
            "type": "scatter",
            "mode": "lines",
            "name": f"axis {reversal.axis}, {DIRECTIONS[reversal.report.direction > 0]}",
            "x": [number * reversal.period_s * 1e3 for number in range(len(reversal.error_m))],
            "y": [None if value is None else value * units.error.factor for value in reversal.error_m],
            "line": {
                "color": colours[place % len(colours)],
                "dash": "solid" if reversal.report.direction > 0 else "dash",
            },
        }
        for place, reversal in enumerate(reversals)
    ]
    layout = layout_of("since the reversal (ms)", f"lag ({units.error.unit})", dark=dark)
    return figure_of(data, layout, revision=units.name)


def newest_of_each(reversals: Iterable[Reversal]) -> list[Reversal]:
    """The last reversal of each axis and direction."""
    newest = {(reversal.axis, reversal.report.direction): reversal for reversal in reversals}
    return [newest[key] for key in sorted(newest, key=lambda key: (key[0], -key[1]))]


def indicators_of(axis: AxisState, required_m: float, units: Units) -> list[Indicator]:
    """The four indicators of an axis' last reversal."""
    last, mean = axis.last, next(iter(INDICATORS))
    if last is None:
        return [Indicator(name, units.error.with_unit(None), above=False) for name in INDICATORS.values()]
    return [
        Indicator(
            name,
            units.error.with_unit(getattr(last, key)),
            above=key == mean and (getattr(last, key) or 0.0) > required_m,
        )
        for key, name in INDICATORS.items()
    ]


def progress_of(learning: LearningState, units: Units) -> Progress:
    """Where a learning run is, or how the last one ended."""
    headline = "No learning run yet." if not learning.axis else f"Axis {learning.axis}: {learning.state}"
    best = ""
    if learning.best_m is not None:
        best = units.error.with_unit(learning.best_m)
        if learning.acceleration_m_s2 is not None:
            best += f" at {units.acceleration.with_unit(learning.acceleration_m_s2)}"
    return Progress(
        headline,
        min(max(learning.progress, 0.0), 1.0),
        STAGES.get(learning.stage, learning.stage),
        f"{learning.strokes_done} of {learning.strokes_total}" if learning.strokes_total else "",
        duration_text(learning.remaining_s) if learning.state in ACTIVE else "",
        best,
        learning.reason,
    )


def possible(learning: LearningState) -> dict[str, bool]:
    """Which commands of learning make sense now; the controller has the last word."""
    state = learning.state
    return {
        "start_learning": state not in ACTIVE,
        "pause_learning": state == "running",
        "resume_learning": state in {"paused", "pausing"},
        "abort_learning": state in ACTIVE,
    }


def duration_text(seconds: float | None) -> str:
    """`1 h 05 min`, `4 min 10 s`, `8 s`."""
    if seconds is None:
        return ""
    whole = round(seconds)
    if whole >= 3600:
        return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
    return f"{whole // 60} min {whole % 60:02d} s" if whole >= 60 else f"{whole} s"


def _level(at: float, colour: str) -> dict[str, Any]:
    return {
        "type": "line",
        "xref": "paper",
        "x0": 0,
        "x1": 1,
        "y0": at,
        "y1": at,
        "line": {"color": colour, "dash": "dash", "width": 2},
    }


def _words(text: str, at: float, colour: str) -> dict[str, Any]:
    return {
        "text": text,
        "xref": "paper",
        "x": 1,
        "xanchor": "right",
        "y": at,
        "yanchor": "bottom",
        "showarrow": False,
        "font": {"color": colour},
    }
