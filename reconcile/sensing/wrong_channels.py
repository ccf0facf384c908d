"""Misread channels: unsigned current, the force of another axis, a force as position.

The share of a force that a rigid axis with friction, springs and gravity explains from the motion decides: it
is large for the right channel and small for a wrong one. To recover a lost sign, the fit alternates with the
sign of the fitted force (Fienup 1982, error reduction).
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
"""Largest value of the other sign in an unsigned channel, its noise, as a share of the largest value."""
LEAST_TURNED_SHARE = 0.1
"""Least share of samples with a recovered negative sign; with fewer there is a constant load."""
UNSIGNED_RATIO = 0.25
"""Largest ratio of residual squares with and without a recovered sign for a missing sign."""
ITERATIONS = 20
UNEXPLAINED, EXPLAINED = 0.5, 0.2
"""Residual shares of the variance of exchanged channels: least with the own force, largest with the other."""
MASS_DECADES, NEARER_DECADES = 1.5, 1.0
"""Largest distance of the mass from exchanged channels to that of the model, in decades, and by how much the
mass from the channels as read must be farther off.
"""
ROUGHER = 10.0
"""Bends of a position over those of its force, from which on the two are exchanged, also unseen by a fit.

A position is its force integrated twice: on the measured axes of the examples it bends 2 to 7000 times less.
"""
BEND_S = 1e-2
"""Time between the samples of a bend: shorter ones are counts of an encoder."""
LEFT_EXCHANGED = 0.5
"""Largest residual share of the variance with exchanged channels."""


def is_unsigned(columns: RigidColumns) -> bool:
    """Return whether the force of an axis that is driven both ways has lost its sign."""
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
    """Return the factor from the force as read to the position; None where the two are not exchanged.

    The columns may have been read in their own units, or in those of each other: the case whose mass is
    nearer to that of the model counts.
    """
    own = rigid_columns(recording.motor_m, recording.force_n, recording.period_s)
    crossed = rigid_columns(recording.force_n, recording.motor_m, recording.period_s)
    if own is None or crossed is None:
        return None
    as_read, fit = rigid_fit(own), rigid_fit(crossed)
    factor = _factor_of(recording, "position") / _factor_of(recording, "force")
    nearest = min((1.0, factor), key=lambda one: _decades(fit.mass_kg / one**2, mass_kg))
    bend_m, bend_n = (_bend(of, recording.period_s) for of in (recording.motor_m, recording.force_n))
    if bend_m > ROUGHER * bend_n:  # gravity and standstill hide mass and friction from any fit
        return nearest
    if fit.left_share > LEFT_EXCHANGED:
        return None
    # the work of a cycle changes its sign with the exchange: friction would drive
    if fit.friction_w <= 0.0 or as_read.friction_w >= 0.0 or fit.mass_kg <= 0.0:
        return None
    off = _decades(fit.mass_kg / nearest**2, mass_kg)
    is_nearer = off < MASS_DECADES and off + NEARER_DECADES < _decades(as_read.mass_kg, mass_kg)
    return nearest if is_nearer else None


def _bend(values: Array, period_s: float) -> float:
    """Return the RMS second difference over BEND_S of a channel (n,), over its standard deviation."""
    step = max(round(BEND_S / period_s), 1)
    bend = values[2 * step :] - 2.0 * values[step:-step] + values[: -2 * step]
    return float(np.sqrt(np.mean(bend**2)) / max(float(np.std(values)), 1e-300))


def _decades(found_kg: float, mass_kg: float) -> float:
    """Return the distance of two masses in decades."""
    return abs(math.log10(found_kg / mass_kg)) if found_kg > 0.0 else math.inf


def _factor_of(recording: AxisRecording, role: str) -> float:
    """Return the factor to SI of the column of a role."""
    origin = recording.origins.get(role)
    return abs(origin.factor) if origin and origin.factor else 1.0


def exchanged_forces(recordings: Sequence[AxisRecording]) -> Iterator[tuple[SensorFinding, str]]:
    """Yield pairs of axes of one file whose forces are exchanged, with the name of the other axis."""
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
    """Return the residual sum of squares of a fit."""
    left = values - matrix @ _fitted(matrix, values)
    return float(left @ left)
