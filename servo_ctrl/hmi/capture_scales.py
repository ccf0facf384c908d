"""Scales of the scope's channels: chosen with the others of the pane, or fixed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from servo_ctrl.hmi.capture_controls import Choices
    from servo_ctrl.hmi.capture_look import Trace


class Scales:
    """A line for every channel that is shown. `on_change` is called when a scale was chosen."""

    def __init__(self, choices: Choices, on_change: Callable[[], None]) -> None:
        self._choices, self._on_change = choices, on_change
        self._shown: list[tuple[str, str]] = []
        with ui.expansion("Scales of the channels").props("data-testid=scope-scales dense"):
            self._lines = ui.element("div").classes("bench-column")

    def show(self, traces: Sequence[Trace]) -> None:
        """These channels, in these units."""
        shown = [(trace.name, trace.scale.unit) for trace in traces]
        if shown == self._shown:
            return
        self._shown = shown
        self._lines.clear()
        with self._lines:
            for trace in traces:
                self._line(trace)

    def _line(self, trace: Trace) -> None:
        with ui.element("div").classes("bench-row"):
            ui.label(trace.name).style("min-width: 190px")
            ends: list[ui.number] = []
            fixed = ui.checkbox("fixed", value=trace.fixed is not None)
            fixed.props(f"data-testid=scope-fixed-{trace.name}")

            def change() -> None:
                low, high = (end.value for end in ends)
                if fixed.value and low is not None and high is not None and low < high:
                    self._choices.fixed[trace.name] = (float(low), float(high))
                else:
                    self._choices.fixed.pop(trace.name, None)
                self._on_change()

            for name, value in zip(("from", "to"), trace.fixed or (-1.0, 1.0), strict=True):
                number = ui.number(name, value=value, format="%.6g", on_change=change)
                number.props(f'outlined dense suffix="{trace.scale.unit}" aria-label="{trace.name} {name}"')
                number.style("width: 140px").bind_enabled_from(fixed, "value")
                number.props(f"data-testid=scope-{name}-{trace.name}")
                ends.append(number)
            fixed.on_value_change(change)
