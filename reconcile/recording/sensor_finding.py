"""A defect that a check of timing or of a sensor found."""

from collections.abc import Iterable
from typing import Literal, NamedTuple

Severity = Literal["note", "warning", "unusable"]


class SensorFinding(NamedTuple):
    """One defect: what, where, how large, what to do.

    A `note` has no consequence, a `warning` can be mistaken for physics, `unusable` data are refused.
    """

    check: str
    """Short name, as in docs/recordings.md: `gap`, `hold`, `clipped`, ..."""
    severity: Severity
    source: str
    axis: str
    channel: str
    """Field of `AxisRecording`, empty for the recording as a whole."""
    start_s: float
    end_s: float
    """Both in the time of the file; NaN for the whole recording."""
    size: float
    unit: str
    message: str
    remedy: str = ""

    def __str__(self) -> str:
        place = ": ".join(part for part in (self.source, self.axis, self.channel) if part)
        text = f"{place}: {self.message}"
        return f"{text}; {self.remedy}" if self.remedy else text


def worst_first(findings: Iterable[SensorFinding]) -> list[SensorFinding]:
    """Sort by severity: unusable, warning, note; stable."""
    order = ("unusable", "warning", "note")
    return sorted(findings, key=lambda finding: order.index(finding.severity))
