"""Fixed scales of the scope's channels; a channel without one is fitted with the others of its pane."""

from collections.abc import Callable, Sequence

from nicegui import ui

from servo_ctrl.hmi.scope.appearance import ShownChannel
from servo_ctrl.hmi.scope.controls import ScopeChoices
from servo_ctrl.hmi.shell.live_content import Rebuilt
from servo_ctrl.hmi.shell.parts import div


class FixedScales:
    """A line of fields for each channel; `on_change` is called when a scale was fixed, changed or freed."""

    def __init__(self, choices: ScopeChoices, on_change: Callable[[], None]) -> None:
        self._choices, self._on_change = choices, on_change
        self._channels: Sequence[ShownChannel] = ()
        with ui.expansion("Scales of the channels").props("dense").mark("scope-scales"):
            self._lines = Rebuilt[object](div("bench-column"), lambda _key: self._build())

    def show(self, channels: Sequence[ShownChannel]) -> None:
        """Offer these channels, in these units; what is being typed stays while they are the same."""
        self._channels = channels
        self._lines.show([(channel.name, channel.unit.unit) for channel in channels])

    def _build(self) -> None:
        for channel in self._channels:
            with div("bench-row"):
                self._line(channel)

    def _line(self, channel: ShownChannel) -> None:
        ui.label(channel.name).style("min-width: 190px")
        ends: list[ui.number] = []
        fixed = ui.checkbox("fixed", value=channel.limits is not None).mark(f"scope-fixed-{channel.name}")

        def change() -> None:
            low, high = (end.value for end in ends)
            if fixed.value and low is not None and high is not None and low < high:
                self._choices.limits[channel.name] = (float(low), float(high))
            else:
                self._choices.limits.pop(channel.name, None)
            self._on_change()

        for name, value in zip(("from", "to"), channel.limits or (-1.0, 1.0), strict=True):
            number = ui.number(name, value=value, format="%.6g", on_change=change)
            number.props(f'suffix="{channel.unit.unit}" aria-label="{channel.name} {name}"')
            number.style("width: 140px").bind_enabled_from(fixed, "value")
            ends.append(number.mark(f"scope-{name}-{channel.name}"))
        fixed.on_value_change(change)
