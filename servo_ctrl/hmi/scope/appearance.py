"""How the scope draws channels: those of one unit share a pane; a fixed scale gets an axis of its own."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from servo_ctrl.hmi.charts.echarts import Options, Trace, chart_options, line_series, trace, value_axis
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.shell.channel_names import channel_title
from servo_ctrl.hmi.shell.plots import ORANGE, PURPLE, Theme
from servo_ctrl.hmi.shell.units import DisplayUnit, UnitSystem

MAX_CHANNELS = 8
"""Bounds the channels that are drawn at once; from the number of colours."""
DEVIATIONS = ("position_error_m", "correction_m")
"""Endings of channels that are lengths of micrometres."""
LEGEND_PERCENT, TIME_AXIS_PERCENT, GAP_PERCENT = 9.0, 14.0, 4.0
"""Shares of the chart's height above the panes, below them, and between two of them, per cent; chosen."""
CURSOR_COLOURS = {"A": ORANGE, "B": PURPLE}
_DECIMALS = {"s": 3, "N": 2, "A": 3}
"""Decimals by unit, for units outside the unit system; chosen."""


class ShownChannel(NamedTuple):
    """A channel that is drawn."""

    name: str
    place: int
    """Column of a row."""
    unit: DisplayUnit
    limits: tuple[float, float] | None = None
    """Fixed lower and upper end of its own axis, as shown; None: fitted with the others of its pane."""
    scale: float = 1.0
    offset: float = 0.0
    """How it is drawn: the shown value times `scale` plus `offset`. Readings are not changed by them."""

    @property
    def title(self) -> str:
        """What an operator calls it."""
        return channel_title(self.name)

    @property
    def drawn_title(self) -> str:
        """The same with scale and offset, where it has some."""
        scale = f" \N{MULTIPLICATION SIGN}{self.scale:g}" if self.scale != 1.0 else ""
        return f"{self.title}{scale}{f' {self.offset:+g}' if self.offset else ''}"

    def drawn(self, shown: float) -> float:
        """Return where a shown value is drawn."""
        return shown * self.scale + self.offset


class ScopeLayout(NamedTuple):
    """What is drawn beside the channels; times in seconds from the trigger."""

    span_s: float
    before_s: float
    """Part of the span before the trigger."""
    cursors: dict[str, float]
    theme: Theme
    level: tuple[str, float] | None = None
    """Trigger level: the channel, and its value as shown."""


def channel_unit(name: str, unit: str, units: UnitSystem) -> DisplayUnit:
    """Return how a channel of this SI unit is shown."""
    if unit == "m":
        return units.error if name.endswith(DEVIATIONS) else units.length
    if unit == "m/s":
        return units.velocity
    return DisplayUnit("" if unit == "1" else unit, 1.0, _DECIMALS.get(unit, 0))


def time_unit(span_s: float) -> DisplayUnit:
    """Return the unit of the time axis."""
    return DisplayUnit("ms", 1e3, 1) if span_s < 2.0 else DisplayUnit("s", 1.0, 4)


def panes_of(channels: Sequence[ShownChannel]) -> list[str]:
    """Return the units, each of which has a pane, in the order of the channels."""
    return list(dict.fromkeys(channel.unit.unit for channel in channels))


def scope_options(
    channels: Sequence[ShownChannel], layout: ScopeLayout, period_s: float
) -> tuple[Options, list[Trace]]:
    """ECharts options, and the traces of frames with the row numbers and the channels."""
    theme, time, panes = layout.theme, time_unit(layout.span_s), panes_of(channels)
    fixed = [channel for channel in channels if channel.limits is not None]
    options = chart_options(theme, [channel.drawn_title for channel in channels])
    height = (100.0 - LEGEND_PERCENT - TIME_AXIS_PERCENT + GAP_PERCENT) / max(len(panes), 1)
    begin = -layout.before_s * time.factor
    line = {"axisLine": {"show": True, "lineStyle": {"color": theme.grid}}}
    options |= {"grid": [], "xAxis": [], "yAxis": [], "dataZoom": zooms(len(panes), theme)}
    for k, unit in enumerate(panes):
        top = {"top": f"{LEGEND_PERCENT + height * k}%", "height": f"{height - GAP_PERCENT}%"}
        options["grid"].append({"left": 64, "right": 16 + 60 * len(fixed), **top})
        lowest = k == len(panes) - 1
        time_axis = value_axis(
            theme, tr("time ({unit})", unit=time.unit) if lowest else "", 24, gridIndex=k, **line
        )
        time_axis |= {"min": begin, "max": begin + layout.span_s * time.factor}
        # labels of the ends would be cut, or make the lowest pane narrower than the others
        time_axis["axisLabel"] |= {"show": lowest, "showMinLabel": False, "showMaxLabel": False}
        options["xAxis"].append(time_axis)
        options["yAxis"].append(value_axis(theme, unit, 46, gridIndex=k, scale=True, **line))
    traces = []
    for place, channel in enumerate(channels):
        pane = panes.index(channel.unit.unit)
        colour, y_axis = theme.curve(place), pane
        if channel.limits is not None:
            y_axis = len(options["yAxis"])
            low, high = channel.limits
            own = {"position": "right", "offset": 60 * fixed.index(channel), "min": low, "max": high}
            own |= {"axisLine": {"show": True, "lineStyle": {"color": colour}}, "splitLine": {"show": False}}
            options["yAxis"].append(value_axis(theme, "", 0, gridIndex=pane) | own)
        series = line_series(channel.name, channel.drawn_title, colour, 1.4, (pane, y_axis))
        if layout.level is not None and layout.level[0] == channel.name:
            series["markLine"] = _level_line(channel.drawn(layout.level[1]))
        options["series"].append(series)
        factors = (period_s * time.factor, channel.unit.factor * channel.scale)
        traces.append(trace(channel.name, 0, place + 1, factors, channel.offset))
    options["series"] += [_cursor_lines(pane, layout, time) for pane in range(len(panes))]
    return options, traces


def zooms(panes: int, theme: Theme) -> list[dict[str, Any]]:
    """Zoom and pan along time, of all panes together: the wheel, two fingers, and a bar below the chart."""
    every = {"xAxisIndex": list(range(panes)), "filterMode": "none"}
    # pointing and dragging alone move the cursors; a wheel that also moved would zoom as well
    inside = {"type": "inside", "moveOnMouseMove": "ctrl", "moveOnMouseWheel": False}
    bar = {
        "type": "slider",
        "bottom": 4,
        "height": 18,
        "showDataShadow": False,
        "showDetail": False,
        "borderColor": theme.grid,
    }
    return [every | inside, every | bar]


def _level_line(level: float) -> dict[str, Any]:
    return {
        "silent": True,
        "symbol": "none",
        "label": {"formatter": tr("level"), "position": "insideEndTop"},
        "lineStyle": {"type": "dashed", "width": 1},
        "data": [{"yAxis": level}],
    }


def _cursor_lines(pane: int, layout: ScopeLayout, time: DisplayUnit) -> Options:
    """Return both cursors in one pane, as marks of a series without points."""
    lines = [
        {
            "xAxis": at_s * time.factor,
            "label": {"formatter": name, "show": pane == 0},
            "lineStyle": {"color": CURSOR_COLOURS[name], "width": 2, "type": "solid"},
        }
        for name, at_s in layout.cursors.items()
    ]
    marks = {"silent": True, "symbol": "none", "data": lines}
    series = {"type": "line", "xAxisIndex": pane, "yAxisIndex": pane, "silent": True, "data": []}
    return {"id": f"cursors {pane}", **series, "markLine": marks}
