"""Checks whether encoders kept their zeros between recordings; incremental ones lose them at power-off."""

from collections.abc import Iterator, Sequence

import numpy as np

from reconcile.recording.recording import AxisRecording
from reconcile.recording.sensor_finding import SensorFinding

LEAST_OFFSET_M = 20e-6
"""Least offset, m, of a re-zeroed encoder; thermal expansion and backlash shift less."""


def rezeroed(recordings: Sequence[AxisRecording], lead_m: float) -> Iterator[SensorFinding]:
    """Yield findings for recordings of one axis whose encoder has another zero than in the first one.

    The motor is compared with the scale, or else with the reference. The message also has the shift within a
    turn, which matters to effects that repeat once a turn.
    """
    for other in recordings[1:]:
        for against in ("scale_m", "reference_m"):
            before, after = _offset_m(recordings[0], against), _offset_m(other, against)
            if before is None or after is None:
                continue
            offset_m = after[0] - before[0]
            in_turn_m = offset_m - lead_m * round(offset_m / lead_m)
            # backlash, expansion and following errors shift it too
            if abs(offset_m) > max(LEAST_OFFSET_M, 3.0 * (before[1] + after[1])):
                message = (
                    f"its zero against {against} is {offset_m * 1e3:+.4f} mm from that of the first "
                    f"recording ({in_turn_m * 1e3:+.4f} mm within a turn): it was re-zeroed"
                )
                remedy = "what depends on the position is fitted with a shift of its own"
                yield SensorFinding(
                    check="origin",
                    severity="note",
                    source=other.source,
                    axis=other.axis,
                    channel="motor_m",
                    start_s=other.start_s,
                    size=offset_m,
                    unit="m",
                    message=message,
                    remedy=remedy,
                )
            break


def _offset_m(recording: AxisRecording, against: str) -> tuple[float, float] | None:
    """Return median difference and spread of two positions at low speed; None where one was not recorded."""
    other = getattr(recording, against)
    if other is None:
        return None
    speed_m_s = np.abs(np.gradient(other, recording.period_s))
    at_rest = speed_m_s <= np.percentile(speed_m_s, 20.0)
    offset_m = (recording.motor_m - other)[at_rest]
    middle_m = float(np.median(offset_m))
    return middle_m, float(np.percentile(np.abs(offset_m - middle_m), 95.0))
