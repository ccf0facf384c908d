"""Fills A4 sheets from top to bottom with text, tables and plots. Lengths are in millimetres."""

import textwrap
from collections.abc import Iterator, Sequence

from servo_ctrl.plots.matplotlib_agg import Axes, Figure, FigureCanvasPdf, Line2D

WIDTH, HEIGHT = 210.0, 297.0
LEFT, RIGHT, TOP, BOTTOM = 20.0, 16.0, 18.0, 18.0
INNER = WIDTH - LEFT - RIGHT
POINT = 25.4 / 72.0
LINE = 1.35
"""Line spacing, as a multiple of the letter size."""
LETTER = 0.54
"""Mean width of a letter of DejaVu Sans, as a share of its size."""
FIGURE = 0.66
"""Width of a digit or of a bold letter, as a share of its size."""
SMALLEST, LARGEST = 4.5, 8.0
"""Bounds of the letter size in a table, points."""
CELL_GAP = 2.5
"""Smallest distance of columns."""
PADDING = 0.7
"""Space above and below the text of a cell."""
LABELS_LEFT, LABELS_BELOW = 16.0, 14.0
"""Space of a plot for the labels of its axes."""
GREY = "0.35"


class Sheets:
    """The sheets being filled; `y` increases downwards from the top edge."""

    def __init__(self, footer: str) -> None:
        self.figures: list[Figure] = []
        self._footer = footer
        self._y = HEIGHT

    def finish(self) -> None:
        """Number the sheets."""
        for number, figure in enumerate(self.figures, start=1):
            text = f"{self._footer}        {number} of {len(self.figures)}"
            figure.text(LEFT / WIDTH, 9.0 / HEIGHT, text, size=7.0, color=GREY)

    def room(self, height: float) -> None:
        """Start the next sheet unless `height` is free on this one."""
        if self._y + height > HEIGHT - BOTTOM:
            figure = Figure(figsize=(WIDTH / 25.4, HEIGHT / 25.4))
            FigureCanvasPdf(figure)
            self.figures.append(figure)
            self._y = TOP

    def gap(self, height: float) -> None:
        """Leave `height` free."""
        self._y += height

    def paragraph(
        self, text: str, size: float, *, bold: bool = False, colour: str = "black", keep: float = 0.0
    ) -> None:
        """Write text, wrapped into lines; `keep`: height below it that must be on the same sheet."""
        letters = int(INNER / (size * POINT * LETTER * (1.08 if bold else 1.0)))
        lines = textwrap.wrap(text, letters) or [""]
        step = size * POINT * LINE
        self.room(len(lines) * step + keep if len(lines) < 6 else step)
        for line in lines:
            self.room(step)
            self._write(LEFT, line, size, bold=bold, colour=colour)
            self._y += step

    def table(self, head: Sequence[str], rows: Sequence[Sequence[str]], words: int) -> None:
        """Draw a table with letters that fit its columns; repeat its head on each sheet."""
        size, widths = _fitted(head, rows)
        step = size * POINT * LINE
        wrapped = [_wrapped(row, widths, size) for row in rows]
        top = _wrapped(head, widths, size) if any(head) else []
        begun = False
        for row in wrapped:
            height = max(map(len, row)) * step + 2.0 * PADDING
            before = len(self.figures)
            self.room(height + (0.0 if begun else max(map(len, top), default=0) * step))
            if (not begun or len(self.figures) > before) and top:
                self._cells(top, widths, size, step, words, bold=True)
                self._rule("0.2", 0.8)
            begun = True
            self._cells(row, widths, size, step, words)
            self._rule("0.8", 0.4)

    def axes(self, height: float, *, polar: bool = False) -> Axes:
        """Make the axes of a plot, with space for labels on the left and below."""
        self.room(height)
        wide = height - LABELS_BELOW - 4.0 if polar else INNER - LABELS_LEFT - 2.0
        left = (INNER - wide) / 2.0 if polar else LABELS_LEFT
        self._y += height
        place = (
            (LEFT + left) / WIDTH,
            (HEIGHT - self._y + LABELS_BELOW) / HEIGHT,
            wide / WIDTH,
            (height - LABELS_BELOW - 2.0) / HEIGHT,
        )
        return self.figures[-1].add_axes(place, projection="polar" if polar else None)

    def _cells(
        self,
        row: list[list[str]],
        widths: Sequence[float],
        size: float,
        step: float,
        words: int,
        *,
        bold: bool = False,
    ) -> None:
        self._y += PADDING
        for x, place, cell in _places(row, widths):
            right = place >= words
            at = x + widths[place] if right else x
            for number, line in enumerate(cell):
                self._write(at, line, size, bold=bold, right=right, down=number * step)
        self._y += max(map(len, row)) * step + PADDING

    def _write(
        self,
        x: float,
        text: str,
        size: float,
        *,
        bold: bool = False,
        colour: str = "black",
        right: bool = False,
        down: float = 0.0,
    ) -> None:
        self.figures[-1].text(
            x / WIDTH,
            1.0 - (self._y + down) / HEIGHT,
            text,
            size=size,
            weight="bold" if bold else "normal",
            color=colour,
            ha="right" if right else "left",
            va="top",
            parse_math=False,  # a "$" in a name must not start a formula
        )

    def _rule(self, colour: str, width: float) -> None:
        y = 1.0 - self._y / HEIGHT
        ends = [LEFT / WIDTH, (WIDTH - RIGHT) / WIDTH]
        self.figures[-1].add_artist(Line2D(ends, [y, y], color=colour, linewidth=width))


def _fitted(head: Sequence[str], rows: Sequence[Sequence[str]]) -> tuple[float, tuple[float, ...]]:
    """Return the size of the letters and the widths of the columns."""
    longest = [max((len(row[place]) for row in rows), default=0) for place in range(len(head))]
    for place in range(len(head)):  # a heading may wrap between words
        longest[place] = max(longest[place], max(map(len, head[place].split()), default=0))
    gaps = CELL_GAP * (len(head) - 1)
    size = min(LARGEST, (INNER - gaps) / max(sum(longest) * POINT * FIGURE, 1e-9))
    size = max(size, SMALLEST)
    widths = [count * size * POINT * FIGURE for count in longest]
    whole = [max(len(head[place]) * size * POINT * FIGURE, widths[place]) for place in range(len(head))]
    too_much = sum(widths) + gaps - INNER
    wanted = sum(whole) - sum(widths)
    if too_much < 0.0 < wanted:  # the free width goes to the headings
        share = min(-too_much / wanted, 1.0)
        widths = [width + share * (full - width) for width, full in zip(widths, whole, strict=True)]
    if too_much > 0.0:  # the widest column, which is text, wraps
        widest = max(range(len(head)), key=lambda place: widths[place])
        widths[widest] = max(widths[widest] - too_much, 20.0)
    return size, tuple(widths)


def _wrapped(row: Sequence[str], widths: Sequence[float], size: float) -> list[list[str]]:
    letters = [max(int(width / (size * POINT * FIGURE) + 0.01), 3) for width in widths]
    return [textwrap.wrap(cell, most) or [""] for cell, most in zip(row, letters, strict=True)]


def _places(row: list[list[str]], widths: Sequence[float]) -> Iterator[tuple[float, int, list[str]]]:
    """Yield left edge, number and lines of each cell; free width goes between the columns."""
    gap = min((INNER - sum(widths)) / max(len(widths) - 1, 1), 14.0)
    x = LEFT
    for place, cell in enumerate(row):
        yield x, place, cell
        x += widths[place] + gap
