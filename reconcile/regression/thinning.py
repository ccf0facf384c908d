"""Long, fast recordings at a lower rate: the mean of each few samples, in all channels and coordinates alike.

What is diagnosed lies below 120 Hz (resonances), mostly below 60 Hz (the state filter), so samples beyond
1 kHz take memory and add little. The kinematics are those at the full rate: a balance of forces holds between
means as between samples, a reversal within a group included.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.kinds import RegressionData
from reconcile.recording.kinematics import Kinematics
from reconcile.recording.recording import AxisRecording
from reconcile.recording.sensor_finding import SensorFinding

MOST_SAMPLES = 300_000
"""Samples of all recordings of an axis from which on they are thinned: five minutes at 1 kHz, for which a
diagnosis of two axes takes 1.2 GB."""
SLOWEST_HZ = 1000.0
"""Least rate after it: eight times the highest frequency that is sought."""


def to_be_thinned(recordings: Sequence[AxisRecording]) -> tuple[list[AxisRecording], list[SensorFinding]]:
    """The recordings of one axis with as many samples in a mean as memory asks for; a note for each."""
    samples = sum(len(recording.time_s) for recording in recordings)
    wanted = -(-samples // MOST_SAMPLES)
    marked, notes = [], []
    for recording in recordings:
        count = max(min(wanted, int(1.0 / (SLOWEST_HZ * recording.period_s))), 1)
        marked.append(recording._replace(samples_in_a_mean=count))
        if count > 1:
            rate_khz = 1e-3 / (recording.period_s * count)
            message = (
                f"{len(recording.time_s)} samples: to save memory the means of each {count} of them are "
                f"explained, at {rate_khz:.3g} kHz"
            )
            notes.append(
                SensorFinding(
                    check="thinned",
                    severity="note",
                    source=recording.source,
                    axis=recording.axis,
                    start_s=recording.start_s,
                    end_s=recording.start_s,
                    size=float(count),
                    unit="samples",
                    message=message,
                )
            )
    return marked, notes


def thinned(data: RegressionData, count: int) -> RegressionData:
    """The data, of one axis alone, with the means of each `count` samples; the last ones are dropped."""
    if count == 1:
        return data
    means: RegressionData = _means(data, count)
    return means._replace(period_s=data.period_s * count, motion=thinned_kinematics(data.motion, count))


def thinned_kinematics(motion: Kinematics, count: int) -> Kinematics:
    """The same of the kinematics of an axis."""
    if count == 1:
        return motion
    last = motion.last_direction[count - 1 :: count]
    means: Kinematics = _means(motion, count)
    return means._replace(last_direction=last[: len(means.position_m)])


def _means(of: Any, count: int) -> Any:
    """A tuple of arrays (n,) by their means, flags by whether all are set; what is not an array stays."""
    found = {}
    for name, values in of._asdict().items():
        if not isinstance(values, np.ndarray):
            continue
        rows = len(values) // count
        groups: Array = values[: rows * count].reshape(rows, count)
        found[name] = groups.all(axis=1) if values.dtype == np.bool_ else groups.mean(axis=1)
    return of._replace(**found)
