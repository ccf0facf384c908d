"""A defect of timing or of a sensor."""

import math
import re
from collections.abc import Iterable, Sequence
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
    axis: str = ""
    channel: str = ""
    """Field of `AxisRecording`, empty for the recording as a whole."""
    start_s: float = math.nan
    end_s: float = math.nan
    """Both in the time of the file; NaN for the whole recording."""
    size: float = 0.0
    unit: str = ""
    message: str = ""
    remedy: str = ""

    def __str__(self) -> str:
        place = ": ".join(part for part in (self.source, self.axis, self.channel) if part)
        text = f"{place}: {self.message}"
        return f"{text}; {self.remedy}" if self.remedy else text


def notes_of(findings: Iterable[SensorFinding]) -> list[str]:
    """Return findings as text; those that differ in numbers only are counted, with the largest as example."""
    alike: dict[tuple[str, ...], list[SensorFinding]] = {}
    for one in findings:
        words = re.sub(r"[\d.+-]+", "", one.message)
        key = (one.severity, one.check, one.axis, one.channel, _file(one), words)
        alike.setdefault(key, []).append(one)
    return [str(own[0]) if len(own) == 1 else _counted(own) for own in alike.values()]


def _counted(alike: Sequence[SensorFinding]) -> str:
    largest = max(alike, key=lambda one: abs(one.size))
    times_s = [at for one in alike for at in (one.start_s, one.end_s) if math.isfinite(at)]
    span = f", {min(times_s):.3f} to {max(times_s):.3f} s" if times_s else ""
    return f"{largest._replace(source=_file(largest))} (x {len(alike)}{span}; the largest is shown)"


def _file(one: SensorFinding) -> str:
    """Return the file of a split recording, without the range of time."""
    return re.sub(r" \[[^\]]* to [^\]]* s\]$", "", one.source)


def worst_first(findings: Iterable[SensorFinding]) -> list[SensorFinding]:
    """Sort by severity: unusable, warning, note; stable."""
    order = ("unusable", "warning", "note")
    return sorted(findings, key=lambda finding: order.index(finding.severity))
