"""Whether the encoders kept their zeros between recordings: incremental ones lose them with the power."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.sensing_finding import Finding

if TYPE_CHECKING:
    from collections.abc import Sequence

    from reconcile.recording import AxisRecording

LEAST_M = 20e-6
"""Thermal expansion and backlash shift the two by less."""


class Origin(NamedTuple):
    """Of one recording against the first of its axis."""

    source: str
    axis: str
    start_s: float
    channel: str
    """The position whose zero is compared; empty where nothing tells."""
    against: str
    offset_m: float
    """NaN where nothing tells."""
    offset_in_turn_m: float
    """The same within one lead: by how much what comes once a turn has shifted."""

    least_m: float
    """What play, expansion or following errors may make of it."""

    @property
    def moved(self) -> bool:
        """Whether the zero is certainly another one."""
        return abs(self.offset_m) > self.least_m

    def finding(self) -> Finding:
        """What to say of an encoder with another zero than in the first recording."""
        message = (
            f"its zero against {self.against} is {self.offset_m * 1e3:+.4f} mm from that of the first "
            f"recording ({self.offset_in_turn_m * 1e3:+.4f} mm within a turn): it was re-zeroed"
        )
        remedy = "what depends on the position is fitted with a shift of its own"
        where = (self.source, self.axis, self.channel, self.start_s, math.nan)
        return Finding("origin", "note", *where, self.offset_m, "m", message, remedy)


def origins(recordings: Sequence[AxisRecording], lead_m: float) -> list[Origin]:
    """Of all recordings of one axis after its first."""
    first = recordings[0]
    return [_origin(first, other, lead_m) for other in recordings[1:]]


def _origin(first: AxisRecording, other: AxisRecording, lead_m: float) -> Origin:
    for channel, against in (("motor_m", "scale_m"), ("motor_m", "reference_m")):
        before, after = _offset_m(first, channel, against), _offset_m(other, channel, against)
        if before is None or after is None:
            continue
        offset_m = after[0] - before[0]
        in_turn_m = offset_m - lead_m * round(offset_m / lead_m)
        least_m = max(LEAST_M, 3.0 * (before[1] + after[1]))
        return Origin(other.source, other.axis, other.start_s, channel, against, offset_m, in_turn_m, least_m)
    return Origin(other.source, other.axis, other.start_s, "", "", math.nan, math.nan, math.inf)


def _offset_m(recording: AxisRecording, channel: str, against: str) -> tuple[float, float] | None:
    """One position less another where they hardly move, and how far that spreads."""
    position, other = getattr(recording, channel), getattr(recording, against)
    if position is None or other is None:
        return None
    slow = np.abs(np.gradient(other, recording.period_s))
    at_rest = slow <= np.percentile(slow, 20.0)
    apart_m = (position - other)[at_rest]
    middle_m = float(np.median(apart_m))
    return middle_m, float(np.percentile(np.abs(apart_m - middle_m), 95.0))
