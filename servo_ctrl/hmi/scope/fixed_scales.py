"""Fields that fix, scale and shift the curves of the scope, a line for each channel that is drawn."""

from collections.abc import Callable, Sequence

from nicegui import ui

from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.scope.appearance import ShownChannel
from servo_ctrl.hmi.scope.controls import ScopeChoices
from servo_ctrl.hmi.shell.channel_names import channel_small_print
from servo_ctrl.hmi.shell.live_content import Rebuilt
from servo_ctrl.hmi.shell.parts import div, faint, named

ENDS = (word("bottom"), word("top"))


class FixedScales:
    """A line of fields for each channel; `on_change` is called when a scale was fixed, changed or freed."""

    def __init__(self, choices: ScopeChoices, on_change: Callable[[], None]) -> None:
        self._choices, self._on_change = choices, on_change
        self._channels: Sequence[ShownChannel] = ()
        with ui.expansion(tr("Scales of the channels")).props("dense").mark("scope-scales"):
            self._lines = Rebuilt(div("bench-column"), self._build)

    def show(self, channels: Sequence[ShownChannel]) -> None:
        """Offer these channels, in these units; what is being typed stays while they are the same."""
        self._channels = channels
        self._lines.show([(channel.name, channel.unit.unit) for channel in channels])

    def _build(self, _key: object) -> None:
        for channel in self._channels:
            with div("bench-row"):
                self._line(channel)

    def _line(self, channel: ShownChannel) -> None:
        with div().style("min-width: 190px"):
            ui.label(channel.title)
            faint(channel_small_print(channel.name)).style("font-size: 11px")
        ends: list[ui.number] = []
        fixed = ui.checkbox(tr("fixed"), value=channel.limits is not None).mark(f"scope-fixed-{channel.name}")

        def change() -> None:
            low, high = (end.value for end in ends)
            if fixed.value and low is not None and high is not None and low < high:
                self._choices.limits[channel.name] = (float(low), float(high))
            else:
                self._choices.limits.pop(channel.name, None)
            self._on_change()

        for name, value in zip(ENDS, channel.limits or (-1.0, 1.0), strict=True):
            number = ui.number(tr(name), value=value, format="%.6g", on_change=change)
            named(number.props(f'suffix="{channel.unit.unit}"'), f"{channel.title} {tr(name)}")
            number.style("width: 140px").bind_enabled_from(fixed, "value")
            ends.append(number.mark(f"scope-{name}-{channel.name}"))
        fixed.on_value_change(change)

        def adjust() -> None:
            scale, offset = (float(one.value) if one.value is not None else 0.0 for one in adjusters)
            self._choices.adjusted[channel.name] = (scale or 1.0, offset)
            self._on_change()

        adjusters = [
            named(
                ui.number(label, value=value, format="%.6g", on_change=adjust)
                .style("width: 110px")
                .mark(f"scope-{mark}-{channel.name}"),
                f"{channel.title} {label}",
            )
            for mark, label, value in (
                ("scale", tr("scale"), channel.scale),
                ("offset", tr("offset"), channel.offset),
            )
        ]
