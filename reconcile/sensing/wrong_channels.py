"""Channels that are not what they were read as: unsigned current, another axis' force, a force as position.

What decides is how much of a force a rigid axis with friction, springs and gravity explains from the motion:
of the right channel most, of a wrong one hardly any. Recovering a lost sign alternates between the sign of
the fit and the fit itself (Fienup 1982, error reduction).
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from kernels.arrays import Array
from reconcile.formats.column_origin import entry_of
from reconcile.recording.recording import AxisRecording
from reconcile.recording.sensor_finding import SensorFinding
from reconcile.sensing.units import RigidColumns, rigid_columns, rigid_fit

LARGEST_OTHER_SIGN = 0.05
"""Largest value of the other sign in a channel without sign, as a share of the largest one: its noise."""
LEAST_TURNED_SHARE = 0.1
"""Least share of the samples in which the recovered sign is turned; fewer, and there is a constant load."""
UNSIGNED_RATIO = 0.25
"""Squares left with a recovered sign over those left without, from which on the sign is missing."""
ITERATIONS = 20
UNEXPLAINED, EXPLAINED = 0.5, 0.2
"""Shares of the variance left by the axis' own force and by the other's from which on they are exchanged."""
MASS_DECADES, NEARER_DECADES = 1.5, 1.0
"""Largest distance of the model's mass from the one that the exchanged channels give, and by how much that of
the channels as they were read must be farther off; no force in newtons moves as a position in metres does."""
LEFT_EXCHANGED = 0.5
"""Share of the variance that the exchanged channels leave, at most."""


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


def exchanged_position(recording: AxisRecording, mass_kg: float) -> float | None:
    """Factor that makes the force, as it was read, the position; None where the two are not exchanged.

    The columns may have kept their own units, or have been read in each other's:
    that of both is taken which gives the mass nearer to the model's.
    """
    own = rigid_columns(recording.motor_m, recording.force_n, recording.period_s)
    crossed = rigid_columns(recording.force_n, recording.motor_m, recording.period_s)
    if own is None or crossed is None:
        return None
    as_read, fit = rigid_fit(own), rigid_fit(crossed)
    if fit.left_share > LEFT_EXCHANGED:
        return None
    # the work of a cycle changes its sign with the exchange: friction would drive
    if fit.friction_w <= 0.0 or as_read.friction_w >= 0.0 or fit.mass_kg <= 0.0:
        return None
    factor = _factor_of(recording, "position") / _factor_of(recording, "force")
    nearest = min((1.0, factor), key=lambda one: _decades(fit.mass_kg / one**2, mass_kg))
    off = _decades(fit.mass_kg / nearest**2, mass_kg)
    is_nearer = off < MASS_DECADES and off + NEARER_DECADES < _decades(as_read.mass_kg, mass_kg)
    return nearest if is_nearer else None


def _decades(found_kg: float, mass_kg: float) -> float:
    """Distance of two masses in decades."""
    return abs(math.log10(found_kg / mass_kg)) if found_kg > 0.0 else math.inf


def _factor_of(recording: AxisRecording, role: str) -> float:
    """What made the column of a role SI."""
    origin = recording.origins.get(role)
    return abs(origin.factor) if origin and origin.factor else 1.0


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
