"""Whether the encoders kept their zeros between recordings; incremental ones lose them with the power."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from reconcile.recording.recording import AxisRecording
from reconcile.recording.sensor_finding import SensorFinding

LEAST_OFFSET_M = 20e-6
"""Least offset, m, that is a re-zeroed encoder: thermal expansion and backlash shift less."""


class EncoderOrigin(NamedTuple):
    """Offset of one recording's encoder zero against the first recording of its axis."""

    source: str
    axis: str
    start_s: float
    channel: str
    """The position whose zero is compared; empty where no other position was recorded."""
    against: str
    offset_m: float
    """NaN where no other position was recorded."""
    offset_in_turn_m: float
    """The same modulo the lead: the shift of effects that repeat once a turn."""
    least_m: float
    """Offset that backlash, expansion or following errors may cause."""

    @property
    def moved(self) -> bool:
        """Whether the encoder was re-zeroed."""
        return abs(self.offset_m) > self.least_m

    def finding(self) -> SensorFinding:
        """Finding of a re-zeroed encoder."""
        message = (
            f"its zero against {self.against} is {self.offset_m * 1e3:+.4f} mm from that of the first "
            f"recording ({self.offset_in_turn_m * 1e3:+.4f} mm within a turn): it was re-zeroed"
        )
        remedy = "what depends on the position is fitted with a shift of its own"
        where = (self.source, self.axis, self.channel, self.start_s, math.nan)
        return SensorFinding("origin", "note", *where, self.offset_m, "m", message, remedy)


def origins(recordings: Sequence[AxisRecording], lead_m: float) -> list[EncoderOrigin]:
    """Origins of all recordings of one axis after its first."""
    first = recordings[0]
    return [_origin(first, other, lead_m) for other in recordings[1:]]


def _origin(first: AxisRecording, other: AxisRecording, lead_m: float) -> EncoderOrigin:
    for channel, against in (("motor_m", "scale_m"), ("motor_m", "reference_m")):
        before, after = _offset_m(first, channel, against), _offset_m(other, channel, against)
        if before is None or after is None:
            continue
        offset_m = after[0] - before[0]
        in_turn_m = offset_m - lead_m * round(offset_m / lead_m)
        least_m = max(LEAST_OFFSET_M, 3.0 * (before[1] + after[1]))
        return EncoderOrigin(
            source=other.source,
            axis=other.axis,
            start_s=other.start_s,
            channel=channel,
            against=against,
            offset_m=offset_m,
            offset_in_turn_m=in_turn_m,
            least_m=least_m,
        )
    return EncoderOrigin(
        source=other.source,
        axis=other.axis,
        start_s=other.start_s,
        channel="",
        against="",
        offset_m=math.nan,
        offset_in_turn_m=math.nan,
        least_m=math.inf,
    )


def _offset_m(recording: AxisRecording, channel: str, against: str) -> tuple[float, float] | None:
    """Median difference of two positions at low speed, and its spread; None where one was not recorded."""
    position, other = getattr(recording, channel), getattr(recording, against)
    if position is None or other is None:
        return None
    speed_m_s = np.abs(np.gradient(other, recording.period_s))
    at_rest = speed_m_s <= np.percentile(speed_m_s, 20.0)
    offset_m = (position - other)[at_rest]
    middle_m = float(np.median(offset_m))
    return middle_m, float(np.percentile(np.abs(offset_m - middle_m), 95.0))
