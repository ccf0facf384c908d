"""The two cursors of the scope: where they are, what the channels are there, and the differences."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from nicegui import ui

from servo_ctrl.hmi.capture_look import time_scale
from servo_ctrl.hmi.capture_stream import reading
from servo_ctrl.hmi.figures_table import figures_table
from servo_ctrl.hmi.units import NOTHING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from servo_ctrl.hmi.capture_controls import Choices
    from servo_ctrl.hmi.capture_look import Trace
    from servo_ctrl.hmi.capture_stream import Rows

CURSORS = ("A", "B")


class Readings:
    """Fields for the cursors, and the table. `on_move` is called when a cursor was set."""

    def __init__(self, choices: Choices, period_s: float, on_move: Callable[[], None]) -> None:
        self._choices, self._period_s, self._on_move = choices, period_s, on_move
        self._shown: list[list[str]] = []
        self._fields: dict[str, ui.number] = {}
        with ui.element("div").classes("bench-row"):
            ui.label("Pointing at the chart sets").classes("bench-faint")
            self._chosen = ui.toggle({name: f"cursor {name}" for name in CURSORS}, value="A")
            self._chosen.props("unelevated data-testid=scope-cursor")
            for name in CURSORS:
                number = ui.number(name, format="%.4f", step=period_s)
                number.props(
                    f'outlined dense data-testid=scope-cursor-{name.lower()} aria-label="Cursor {name}"'
                )
                number.style("width: 140px").on_value_change(
                    lambda event, name=name: self._typed(name, event.value)
                )
                self._fields[name] = number
            ui.button("Remove", on_click=self._remove).props("flat data-testid=scope-cursors-remove")
        self._table = ui.html("", sanitize=False).classes("bench-scroll").props("data-testid=scope-readings")

    def pick(self, x: float, other: bool) -> None:
        """A cursor is put to where the chart was pointed at, in its unit; `other`: the one not chosen."""
        name = str(self._chosen.value)
        if other:
            name = CURSORS[1 - CURSORS.index(name)]
        at_s = round(x / self._factor() / self._period_s) * self._period_s
        self._fields[name].set_value(round(at_s * self._factor(), 9))

    def rescale(self) -> None:
        """The time base has another unit."""
        for name, number in self._fields.items():
            at_s = self._choices.cursors.get(name)
            number.set_value(None if at_s is None else round(at_s * self._factor(), 9))

    def refresh(self, rows: Rows, origin: int, traces: Sequence[Trace]) -> None:
        """Read the rows at the cursors."""
        time = time_scale(self._choices.span_s)
        for number in self._fields.values():
            number.props(f'suffix="{time.unit}" step={self._period_s * time.factor:g}')
        at_s = {name: self._choices.cursors.get(name, math.nan) for name in CURSORS}
        read = {
            name: None if math.isnan(value) else reading(rows, origin + value / self._period_s)
            for name, value in at_s.items()
        }
        apart_s = at_s["B"] - at_s["A"]
        lines = [["", "A", "B", "B \N{MINUS SIGN} A", ""]]
        lines.append(["time", *(time.text(value) for value in (at_s["A"], at_s["B"], apart_s)), time.unit])
        rate = 1.0 / abs(apart_s) if apart_s else math.nan
        lines.append(
            ["1 / (B \N{MINUS SIGN} A)", "", "", f"{rate:.4g}" if math.isfinite(rate) else NOTHING, "Hz"]
        )
        for trace in traces:
            first, second = (
                math.nan if (values := read[name]) is None else float(values[trace.place]) for name in CURSORS
            )
            texts = [trace.scale.text(value, sign=True) for value in (first, second, second - first)]
            lines.append([trace.name, *texts, trace.scale.unit])
        if lines != self._shown:
            self._shown = lines
            self._table.set_content(figures_table(lines[0], lines[1:]))

    def _factor(self) -> float:
        return time_scale(self._choices.span_s).factor

    def _typed(self, name: str, value: float | None) -> None:
        if value is None or not math.isfinite(value):
            self._choices.cursors.pop(name, None)
        else:
            self._choices.cursors[name] = float(value) / self._factor()
        self._on_move()

    def _remove(self) -> None:
        for number in self._fields.values():
            number.set_value(None)
