"""The two cursors of the scope: their times, the channels there, and the differences."""

import math
from collections.abc import Callable, Sequence

from nicegui import ui

from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.scope.appearance import CURSOR_COLOURS, ShownChannel, time_unit
from servo_ctrl.hmi.scope.controls import ScopeChoices
from servo_ctrl.hmi.scope.stream import CapturedRows, row_at
from servo_ctrl.hmi.shell.channel_names import channel_small_print
from servo_ctrl.hmi.shell.live_content import TextTable
from servo_ctrl.hmi.shell.parts import button, div, faint, named
from servo_ctrl.hmi.shell.units import MINUS, NO_VALUE, DisplayUnit

CURSORS = tuple(CURSOR_COLOURS)


class CursorReadings:
    """The fields of the cursors and the table of values; `on_move` is called when a cursor was moved."""

    def __init__(self, choices: ScopeChoices, period_s: float, on_move: Callable[[], None]) -> None:
        self._choices, self._period_s, self._on_move = choices, period_s, on_move
        self._fields: dict[str, ui.number] = {}
        with div("bench-row"):
            faint(tr("Pointing at the chart sets"))
            self._chosen = ui.toggle({name: tr("cursor {name}", name=name) for name in CURSORS}, value="A")
            self._chosen.props("unelevated").mark("scope-cursor")
            for name in CURSORS:
                number = ui.number(name, format="%.4f", step=period_s).mark(f"scope-cursor-{name.lower()}")
                named(number, tr("Cursor {name}", name=name)).style("width: 140px")
                number.on_value_change(lambda event, name=name: self._typed(name, event.value))
                self._fields[name] = number
            button(tr("Remove"), self._remove, "scope-cursors-remove", look="flat")
        self._table = TextTable("scope-readings", ("", "A", "B", f"B {MINUS} A", ""), figures=True)

    def pick(self, x: float, other: bool) -> None:
        """Move the chosen cursor to `x`, in the unit of the chart; `other`: the cursor that is not chosen."""
        name = str(self._chosen.value)
        if other:
            name = CURSORS[1 - CURSORS.index(name)]
        factor = self._time().factor
        at_s = round(x / factor / self._period_s) * self._period_s
        self._fields[name].set_value(round(at_s * factor, 9))

    def rescale(self) -> None:
        """Show the times in the unit of another time base."""
        for name, number in self._fields.items():
            at_s = self._choices.cursors.get(name)
            number.set_value(None if at_s is None else round(at_s * self._time().factor, 9))

    def refresh(self, rows: CapturedRows, origin: int, channels: Sequence[ShownChannel]) -> None:
        """Show the rows at the cursors; `origin` is the row at which the time is zero."""
        time = self._time()
        for number in self._fields.values():
            number.props(f'suffix="{time.unit}" step={self._period_s * time.factor:g}')
        a_s, b_s = (self._choices.cursors.get(name, math.nan) for name in CURSORS)
        row_a, row_b = (
            None if math.isnan(at_s) else row_at(rows, origin + at_s / self._period_s) for at_s in (a_s, b_s)
        )
        difference_s = b_s - a_s
        rate_hz = 1.0 / abs(difference_s) if difference_s else math.nan
        rate = f"{rate_hz:.4g}" if math.isfinite(rate_hz) else NO_VALUE
        lines = [
            [tr("time"), *(time.text(value) for value in (a_s, b_s, difference_s)), time.unit],
            [f"1 / (B {MINUS} A)", "", "", rate, "Hz"],
        ]
        for channel in channels:
            a, b = (math.nan if row is None else float(row[channel.place]) for row in (row_a, row_b))
            texts = (channel.unit.text(value, sign=True) for value in (a, b, b - a))
            lines.append([f"{channel.title}\n{channel_small_print(channel.name)}", *texts, channel.unit.unit])
        self._table.show(lines)

    def _time(self) -> DisplayUnit:
        return time_unit(self._choices.span_s)

    def _typed(self, name: str, value: float | None) -> None:
        if value is None or not math.isfinite(value):
            self._choices.cursors.pop(name, None)
        else:
            self._choices.cursors[name] = float(value) / self._time().factor
        self._on_move()

    def _remove(self) -> None:
        for number in self._fields.values():
            number.set_value(None)
