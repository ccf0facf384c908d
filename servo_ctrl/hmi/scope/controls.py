"""The settings of the scope as a visitor chooses them, with their fields."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from nicegui import ui

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.hmi.languages.texts import tr, translated, word
from servo_ctrl.hmi.scope.appearance import MAX_CHANNELS, ShownChannel, channel_unit, time_unit
from servo_ctrl.hmi.scope.capture import CaptureSettings, TriggerMode
from servo_ctrl.hmi.scope.math_channels import ExpressionError, MathChannel, math_channel
from servo_ctrl.hmi.scope.trigger import Trigger, TriggerKind
from servo_ctrl.hmi.shell.channel_names import channel_small_print, channel_title
from servo_ctrl.hmi.shell.parts import choice, div, with_small_print
from servo_ctrl.hmi.shell.units import DisplayUnit, UnitSystem

SPANS_S = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0)
"""Offered time bases, seconds; chosen."""
KINDS: dict[TriggerKind, str] = {
    "free": word("free running"),
    "reversal": word("reversal of an axis"),
    "rising": word("level, rising"),
    "falling": word("level, falling"),
    "fault": word("fault or stop"),
}
MODES: dict[TriggerMode, str] = {"auto": word("Auto"), "normal": word("Normal"), "single": word("Single")}
BEFORE_PERCENT = (0, 10, 25, 50, 75, 90)
"""Offered shares of the window before the trigger, per cent; chosen."""
AUTO_WAIT_S = 0.5
"""Mode auto: time without a trigger after which the scope is free running, seconds; chosen."""
FIRST_CHANNELS = ("position_error_m", "velocity_command_m_s")
"""Channels of each axis that a scope shows when it is opened."""


@dataclass
class ScopeChoices:
    """The choices; `channels` and `source` are names, levels and limits are in shown units."""

    channels: list[str]
    span_s: float = 2.0
    kind: TriggerKind = "free"
    source: str = ""
    level: float = 0.0
    hysteresis: float = 0.0
    before_percent: float = 25.0
    mode: TriggerMode = "auto"
    limits: dict[str, tuple[float, float]] = field(default_factory=dict)
    adjusted: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Scale and offset by channel."""
    expressions: list[str] = field(default_factory=list)
    """Of the channels that are computed."""
    cursors: dict[str, float] = field(default_factory=dict)

    def settings(self, period_s: float) -> CaptureSettings:
        """Return the settings of the capture, in rows."""
        span = max(round(self.span_s / period_s), 2)
        free = self.kind == "free"
        before = 0 if free else round(span * self.before_percent / 100.0)
        return CaptureSettings(span, before, self.mode, free, round(AUTO_WAIT_S / period_s))

    def before_s(self) -> float:
        """Return the time that is shown before zero, seconds."""
        return self.span_s * (1.0 if self.kind == "free" else self.before_percent / 100.0)

    def trigger(self, hello: Hello, units: UnitSystem) -> Trigger:
        """Return the trigger, in SI units."""
        places = {channel.name: place for place, channel in enumerate(hello.channels)}
        if self.kind == "free":
            return Trigger()
        if self.kind == "fault":
            return Trigger("fault", tuple(places[f"{axis.name}.statusword"] for axis in hello.axes))
        if self.kind == "reversal":
            return Trigger("reversal", (places[f"{axis_of(self.source, hello)}.position_command_m"],))
        channel = hello.channels[places.get(self.source, 0)]
        factor = channel_unit(channel.name, channel.unit, units).factor
        hysteresis = max(self.hysteresis, 0.0) / factor
        return Trigger(self.kind, (places[channel.name],), self.level / factor, hysteresis)

    def shown_channels(self, hello: Hello, units: UnitSystem) -> list[ShownChannel]:
        """Return the channels that are drawn; those that the machine lacks are left out."""
        known = {
            channel.name: (place, channel_unit(channel.name, channel.unit, units))
            for place, channel in enumerate(hello.channels)
        }
        for number, math in enumerate(self.math(hello)):
            known[math.expression] = (len(hello.channels) + number, DisplayUnit(math.unit, 1.0, 3))
        names = [*self.channels, *(text for text in self.expressions if text not in self.channels)]
        return [
            ShownChannel(name, *known[name], self.limits.get(name), *self.adjusted.get(name, (1.0, 0.0)))
            for name in [name for name in names if name in known][:MAX_CHANNELS]
        ]

    def math(self, hello: Hello) -> list[MathChannel]:
        """Return the computed channels; expressions that do not fit the machine are left out."""
        names = {channel.name: place for place, channel in enumerate(hello.channels)}
        found = []
        for text in self.expressions:
            with suppress(ExpressionError):
                found.append(math_channel(text, names))
        return found


def axis_of(source: str, hello: Hello) -> str:
    """Return the axis of a channel; the first axis where it has none."""
    axis = source.rpartition(".")[0]
    return axis if axis in {entry.name for entry in hello.axes} else hello.axes[0].name


def _channel_options(names: Sequence[str]) -> dict[str, str]:
    """Return by name: the title of a channel, and in a second line its small print."""
    return {name: f"{channel_title(name)}\n{channel_small_print(name)}" for name in names}


def first_choices(hello: Hello) -> ScopeChoices:
    """Return the choices of a scope that was just opened."""
    names = [f"{axis.name}.{channel}" for channel in FIRST_CHANNELS for axis in hello.axes]
    return ScopeChoices(names[:MAX_CHANNELS])


class ScopeFields:
    """The fields above the scope.

    `on_change` is called with "look" when the chart has to be redrawn, with "capture" when the capture
    has to restart too.
    """

    def __init__(self, hello: Hello, choices: ScopeChoices, on_change: Callable[[str], None]) -> None:
        self._hello, self._choices, self._on_change = hello, choices, on_change
        self._names = [channel.name for channel in hello.channels]
        with div("bench-row"):
            channels = ui.select(
                _channel_options(self._names),
                value=choices.channels,
                multiple=True,
                label=tr("Channels (8 at most)"),
            )
            with_small_print(channels)
            channels.props(f"use-chips max-values={MAX_CHANNELS}").mark("scope-channels")
            channels.style("flex: 1 1 320px; min-width: 0").on_value_change(self._setter("channels", "look"))
            spans = {span: f"{span * time_unit(span).factor:g} {time_unit(span).unit}" for span in SPANS_S}
            self._select(spans, "span_s", tr("Time base"), "110px")
            self._select(translated(KINDS), "kind", tr("Trigger"), "190px")
        with div("bench-row") as self._details:
            self._source = with_small_print(self._select({}, "source", tr("Of"), "220px"))
            self._levels = [
                self._number(tr("Level"), "level", choices.level),
                self._number(tr("Hysteresis"), "hysteresis", choices.hysteresis).props("min=0"),
            ]
            before = {percent: f"{percent} %" for percent in BEFORE_PERCENT}
            self._select(before, "before_percent", tr("Pre-trigger"), "110px")
            mode = ui.toggle(translated(MODES), value=choices.mode).props("unelevated").mark("scope-mode")
            mode.on_value_change(self._setter("mode", "capture"))
        self.refresh()

    def refresh(self) -> None:
        """Show only the fields that the chosen trigger has."""
        kind = self._choices.kind
        self._details.set_visibility(kind != "free")
        for level in self._levels:
            level.set_visibility(kind in {"rising", "falling"})
        self._source.set_visibility(kind not in {"free", "fault"})
        options = _channel_options(self._names)
        if kind == "reversal":
            options = {f"{axis.name}.": axis.name for axis in self._hello.axes}
        if self._choices.source not in options:
            shown = self._choices.channels[0] if self._choices.channels else ""
            self._choices.source = shown if shown in options else next(iter(options))
        self._source.set_options(options, value=self._choices.source)

    def show_unit(self, units: UnitSystem) -> None:
        """Show the unit of the trigger's channel behind its level."""
        channel = next((c for c in self._hello.channels if c.name == self._choices.source), None)
        unit = channel_unit(channel.name, channel.unit, units).unit if channel else ""
        for level in self._levels:
            level.props(f'suffix="{unit}"')

    def _number(self, label: str, name: str, value: float) -> ui.number:
        number = ui.number(label, value=value, format="%.6g").mark(f"scope-{name}").style("width: 130px")
        return number.on_value_change(self._setter(name, "capture"))

    def _select(self, options: dict[Any, str], name: str, label: str, width: str) -> ui.select:
        value = getattr(self._choices, name)
        mark, chosen = f"scope-{name.replace('_', '-')}", value if value in options else None
        select = choice(options, label, mark, f"width: {width}", value=chosen)
        return select.on_value_change(self._setter(name, "capture"))

    def _setter(self, name: str, what: str) -> Callable[[Any], None]:
        def change(event: Any) -> None:
            if event.value is None or getattr(self._choices, name) == event.value:
                return
            setattr(self._choices, name, event.value)
            self._on_change(what)

        return change
