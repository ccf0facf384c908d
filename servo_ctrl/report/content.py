"""The content of a report, which page and PDF both draw, so that they cannot differ.

All text is plain; the drawing code escapes it. Lengths are in the units that the labels name.
"""

from typing import Literal, NamedTuple

from kernels.arrays import Array

Kind = Literal["lines", "points", "polar", "logarithmic", "semilogarithmic"]
"""Logarithmic: both axes; semilogarithmic: the horizontal one."""


class Series(NamedTuple):
    """A curve, or points, (n,) each; the angle of a polar plot in radians. NaN is a gap."""

    name: str
    x: Array
    y: Array
    spread: Array | None = None
    """Half the length of an error bar at each point."""


class LevelLine(NamedTuple):
    """A horizontal line across a plot."""

    name: str
    value: float


class ReportPicture(NamedTuple):
    """One plot, whose series differ by colour, dash and marker."""

    name: str
    """Letters, digits and hyphens; unique in the report."""
    heading: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    note: str = ""
    levels: tuple[LevelLine, ...] = ()
    kind: Kind = "lines"
    division: float = 0.0
    """Distance of the rings of a polar plot; the commanded circle is 0."""


class ReportTable(NamedTuple):
    """Rows of cells; the first `words` columns are text, aligned left, the others numbers, aligned right."""

    heading: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1
    note: str = ""


class ReportSection(NamedTuple):
    """A heading with its paragraphs, tables and plots, in order."""

    heading: str
    text: tuple[str, ...]
    """Paragraphs."""
    parts: tuple[ReportTable | ReportPicture, ...] = ()


class Report(NamedTuple):
    """A whole report."""

    title: str
    verdict: str
    """One or two words: completed, stopped, not closed."""
    good: bool
    sentence: str
    """The reason for the verdict."""
    sections: tuple[ReportSection, ...]
