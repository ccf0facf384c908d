"""The lines of the program around the one under way, which is marked."""

from collections.abc import Sequence

from nicegui import ui

from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.shell.live_content import Rebuilt
from servo_ctrl.hmi.shell.parts import div, named

AROUND = 3
"""Lines before and behind; chosen."""


class LineView:
    """Hidden while no line is under way."""

    def __init__(self) -> None:
        self._place = div("bench-lines num").mark("line-under-way")
        named(self._place, tr("Line under way"))
        self._view = Rebuilt(self._place, _show)

    def show(self, text: str, line: int) -> None:
        """Show the surroundings of a line, from 1; 0 = none is under way."""
        shown = lines_around(text, line)
        self._place.set_visibility(bool(shown))
        self._view.show(shown)


def lines_around(text: str, line: int) -> tuple[tuple[int, str, bool], ...]:
    """Number and text of the lines around this one, and whether it is the one."""
    lines = text.split("\n")
    if not 1 <= line <= len(lines):
        return ()
    first, last = max(line - AROUND, 1), min(line + AROUND, len(lines))
    return tuple((number, lines[number - 1][:200], number == line) for number in range(first, last + 1))


def _show(lines: Sequence[tuple[int, str, bool]]) -> None:
    for number, text, under_way in lines:
        with div("here" if under_way else "") as row:
            if under_way:
                row.props("aria-current=step")
            ui.label(f"{'▶' if under_way else ''} {number}")
            ui.label(text)
