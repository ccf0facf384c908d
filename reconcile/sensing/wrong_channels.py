"""Channels that are not what they were read as: a current without its sign, the force of another axis.

What decides is how much of a force a rigid axis with friction, springs and gravity explains from the motion:
of the right channel most, of a wrong one hardly any. Recovering a lost sign alternates between the sign of
the fit and the fit itself (Fienup 1982, error reduction).
"""

from collections.abc import Iterator, Sequence

import numpy as np

from kernels.arrays import Array
from reconcile.formats.column_origin import entry_of
from reconcile.recording.recording import AxisRecording
from reconcile.recording.sensor_finding import SensorFinding
from reconcile.sensing.units import RigidColumns, rigid_columns

LARGEST_OTHER_SIGN = 0.05
"""Largest value of the other sign in a channel without sign, as a share of the largest one: its noise."""
LEAST_TURNED_SHARE = 0.1
"""Least share of the samples in which the recovered sign is turned; fewer, and there is a constant load."""
UNSIGNED_RATIO = 0.25
"""Squares left with a recovered sign over those left without, from which on the sign is missing."""
ITERATIONS = 20
UNEXPLAINED, EXPLAINED = 0.5, 0.2
"""Shares of the variance left by the axis' own force and by the other's from which on they are exchanged."""


def is_unsigned(columns: RigidColumns) -> bool:
    """Whether the force of an axis that is driven both ways has lost its sign."""
    force_n = columns.force_n
    low, high = float(force_n.min()), float(force_n.max())
    if min(-low, high) > LARGEST_OTHER_SIGN * max(-low, high):
        return False
    size_n = np.abs(force_n)
    plain = _left(columns.matrix, force_n)
    best, turned = np.inf, 0.0
    for start in (columns.velocity, columns.acceleration):
        sign = np.sign(start)
        for _ in range(ITERATIONS):
            fitted = columns.matrix @ _fitted(columns.matrix, sign * size_n)
            sign = np.where(fitted < 0.0, -1.0, 1.0)
        left = float(np.sum((sign * size_n - fitted) ** 2))
        if left < best:
            best, turned = left, min(float(np.mean(sign < 0.0)), float(np.mean(sign > 0.0)))
    return best < UNSIGNED_RATIO * plain and turned > LEAST_TURNED_SHARE


def exchanged_forces(recordings: Sequence[AxisRecording]) -> Iterator[tuple[SensorFinding, str]]:
    """Find pairs of axes of one file each of whose forces moves the other; with the other axis' name."""
    for place, one in enumerate(recordings):
        for other in recordings[place + 1 :]:
            same = (one.source, one.start_s, len(one.time_s)) == (
                other.source,
                other.start_s,
                len(other.time_s),
            )
            if not same or one.axis == other.axis:
                continue
            if _explain_each_other(one, other):
                message = f"its force moves axis {other.axis}, and that of axis {other.axis} moves it"
                entries = [
                    f"{a.axis}.{_after_axis(entry_of(b.origins, a.axis, 'force_n', 1.0))}"
                    for a, b in ((one, other), (other, one))
                ]
                remedy = f"the forces or the positions are exchanged: --map {','.join(entries)}"
                where = (one.source, one.axis, "force_n", one.start_s, one.start_s + one.time_s[-1])
                finding = SensorFinding("exchanged", "unusable", *where, 1.0, "1", message, remedy)
                yield finding, other.axis


def _after_axis(entry: str) -> str:
    return entry.partition(".")[2]


def _explain_each_other(one: AxisRecording, other: AxisRecording) -> bool:
    def share(motion: AxisRecording, force: AxisRecording) -> float:
        columns = rigid_columns(motion.motor_m, force.force_n, motion.period_s)
        if columns is None:
            return 1.0
        force_n = columns.force_n - columns.force_n.mean()
        return _left(columns.matrix, columns.force_n) / max(float(force_n @ force_n), 1e-300)

    own, crossed = ((one, one), (other, other)), ((one, other), (other, one))
    return all(share(*pair) > UNEXPLAINED for pair in own) and all(
        share(*pair) < EXPLAINED for pair in crossed
    )


def _fitted(matrix: Array, values: Array) -> Array:
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    found: Array = np.linalg.lstsq(matrix / scale, values, rcond=1e-6)[0] / scale
    return found


def _left(matrix: Array, values: Array) -> float:
    """Sum of squares that a fit leaves."""
    left = values - matrix @ _fitted(matrix, values)
    return float(left @ left)
