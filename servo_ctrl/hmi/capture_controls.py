"""The scope's settings as a visitor makes them, and their fields on the page."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from nicegui import ui

from servo_ctrl.hmi.capture import Settings
from servo_ctrl.hmi.capture_look import CHANNELS_AT_MOST, Trace, scale_of, time_scale
from servo_ctrl.hmi.trigger import Trigger

if TYPE_CHECKING:
    from collections.abc import Callable

    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.hmi.capture import Mode
    from servo_ctrl.hmi.trigger import Kind
    from servo_ctrl.hmi.units import Units

SPANS_S = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0)
KINDS: dict[Kind, str] = {
    "free": "free running",
    "reversal": "reversal of an axis",
    "rising": "level, rising",
    "falling": "level, falling",
    "fault": "fault or stop",
}
MODES: dict[Mode, str] = {"auto": "Auto", "normal": "Normal", "single": "Single"}
PATIENCE_S = 0.5
TELLING = ("position_error_m", "velocity_command_m_s")
"""Channels that are shown at first, of each axis."""


@dataclass
class Choices:
    """What a visitor has chosen; `channels` and `source` are names, the levels and `fixed` in shown units."""

    channels: list[str]
    span_s: float = 2.0
    kind: Kind = "free"
    source: str = ""
    level: float = 0.0
    hysteresis: float = 0.0
    before_percent: float = 25.0
    mode: Mode = "auto"
    fixed: dict[str, tuple[float, float]] = field(default_factory=dict)
    cursors: dict[str, float] = field(default_factory=dict)

    def settings(self, period_s: float) -> Settings:
        """For the capture."""
        span = max(round(self.span_s / period_s), 2)
        free = self.kind == "free"
        before = 0 if free else round(span * self.before_percent / 100.0)
        return Settings(span, before, self.mode, free, round(PATIENCE_S / period_s))

    def before_s(self) -> float:
        """What the picture has before its zero, seconds."""
        return self.span_s * (1.0 if self.kind == "free" else self.before_percent / 100.0)

    def trigger(self, hello: Hello, units: Units) -> Trigger:
        """For the capture."""
        places = {channel.name: place for place, channel in enumerate(hello.channels)}
        if self.kind == "free":
            return Trigger()
        if self.kind == "fault":
            return Trigger("fault", tuple(places[f"{axis.name}.statusword"] for axis in hello.axes))
        if self.kind == "reversal":
            return Trigger("reversal", (places[f"{axis_of(self.source, hello)}.position_command_m"],))
        channel = hello.channels[places.get(self.source, 0)]
        factor = scale_of(channel.name, channel.unit, units).factor
        hysteresis = max(self.hysteresis, 0.0) / factor
        return Trigger(self.kind, (places[channel.name],), self.level / factor, hysteresis)

    def traces(self, hello: Hello, units: Units) -> list[Trace]:
        """What is drawn; channels that the machine does not have are left out."""
        known = {channel.name: (place, channel.unit) for place, channel in enumerate(hello.channels)}
        chosen = [name for name in self.channels if name in known][:CHANNELS_AT_MOST]
        return [
            Trace(name, known[name][0], scale_of(name, known[name][1], units), self.fixed.get(name))
            for name in chosen
        ]


def axis_of(source: str, hello: Hello) -> str:
    """The axis of a channel; the first one where it has none."""
    axis = source.rpartition(".")[0]
    return axis if axis in {entry.name for entry in hello.axes} else hello.axes[0].name


def first_choices(hello: Hello) -> Choices:
    """What a scope shows before anything was chosen."""
    names = [f"{axis.name}.{channel}" for channel in TELLING for axis in hello.axes]
    return Choices(names[:CHANNELS_AT_MOST])


class Fields:
    """The fields above the scope. `on_change` is called with what has to begin anew: "look" or "capture"."""

    def __init__(self, hello: Hello, choices: Choices, on_change: Callable[[str], None]) -> None:
        self._hello, self._choices, self._on_change = hello, choices, on_change
        names = {channel.name: channel.name for channel in hello.channels}
        with ui.element("div").classes("bench-row"):
            channels = ui.select(names, value=choices.channels, multiple=True, label="Channels (8 at most)")
            channels.props(
                f"outlined dense use-chips max-values={CHANNELS_AT_MOST} data-testid=scope-channels"
            )
            channels.style("flex: 1 1 320px; min-width: 0").on_value_change(self._set("channels", "look"))
            spans = {span: f"{span * time_scale(span).factor:g} {time_scale(span).unit}" for span in SPANS_S}
            self._select(spans, "span_s", "Time base", "110px")
            self._select(dict(KINDS), "kind", "Trigger", "190px")
        with ui.element("div").classes("bench-row") as self._details:
            self._source = self._select({}, "source", "Of", "220px")
            self._levels = [
                self._number("Level", "level", choices.level),
                self._number("Hysteresis", "hysteresis", choices.hysteresis).props("min=0"),
            ]
            before = {percent: f"{percent} %" for percent in (0, 10, 25, 50, 75, 90)}
            self._select(before, "before_percent", "Before it", "110px")
            mode = ui.toggle(dict(MODES), value=choices.mode).props("data-testid=scope-mode unelevated")
            mode.on_value_change(self._set("mode", "capture"))
        self.refresh()

    def refresh(self) -> None:
        """Show only the fields that matter for the kind of trigger."""
        kind, hello = self._choices.kind, self._hello
        self._details.set_visibility(kind != "free")
        for level in self._levels:
            level.set_visibility(kind in {"rising", "falling"})
        self._source.set_visibility(kind not in {"free", "fault"})
        if kind == "reversal":
            options = {f"{axis.name}.": axis.name for axis in hello.axes}
        else:
            options = {channel.name: channel.name for channel in hello.channels}
        if self._choices.source not in options:
            shown = self._choices.channels[0] if self._choices.channels else ""
            self._choices.source = shown if shown in options else next(iter(options))
        self._source.set_options(options, value=self._choices.source)

    def show_unit(self, units: Units) -> None:
        """The level is in the unit of its channel."""
        channel = next((c for c in self._hello.channels if c.name == self._choices.source), None)
        unit = scale_of(channel.name, channel.unit, units).unit if channel else ""
        for level in self._levels:
            level.props(f'suffix="{unit}"')

    def _number(self, label: str, name: str, value: float) -> ui.number:
        number = ui.number(label, value=value, format="%.6g")
        number.props(f"outlined dense data-testid=scope-{name}").style("width: 130px")
        return number.on_value_change(self._set(name, "capture"))

    def _select(self, options: dict[Any, str], name: str, label: str, width: str) -> ui.select:
        value = getattr(self._choices, name)
        select = ui.select(options, value=value if value in options else None, label=label)
        select.props(f"outlined dense options-dense data-testid=scope-{name.replace('_', '-')}")
        select.style(f"width: {width}").on_value_change(self._set(name, "capture"))
        return select

    def _set(self, name: str, what: str) -> Callable[[Any], None]:
        def change(event: Any) -> None:
            if event.value is None or getattr(self._choices, name) == event.value:
                return
            setattr(self._choices, name, event.value)
            self._on_change(what)

        return change
