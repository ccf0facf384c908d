"""The content of a report. Page and PDF draw the same content, so they cannot differ.

All text is plain; what draws it escapes it. Lengths are in the units that the labels name.
"""

from typing import Literal, NamedTuple

from kernels.arrays import Array

Kind = Literal["lines", "points", "polar", "logarithmic"]


class Series(NamedTuple):
    """A curve, or points, (n,) each; the angle of a polar picture in radians. NaN is a gap."""

    name: str
    x: Array
    y: Array
    spread: Array | None = None
    """Half the length of an error bar at each point."""


class LevelLine(NamedTuple):
    """A horizontal line across a picture."""

    name: str
    value: float


class ReportPicture(NamedTuple):
    """One picture; its series differ by colour, by dash and by marker."""

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
    """Polar: what one ring is; the commanded circle is 0."""


class ReportTable(NamedTuple):
    """Rows of cells; the first `words` columns are aligned left, the numbers right."""

    heading: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1
    note: str = ""


class ReportSection(NamedTuple):
    """A heading with its paragraphs, tables and pictures, in order."""

    heading: str
    text: tuple[str, ...]
    """Paragraphs."""
    parts: tuple[ReportTable | ReportPicture, ...] = ()


class Report(NamedTuple):
    """A whole report."""

    title: str
    verdict: str
    """One word or two: completed, stopped, torn off."""
    good: bool
    sentence: str
    """The reason for the verdict."""
    sections: tuple[ReportSection, ...]
