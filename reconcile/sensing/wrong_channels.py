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
LEAST_OWN_RESIDUAL, MOST_CROSSED_RESIDUAL = 0.5, 0.2
"""Residual shares of exchanged forces: least with the own motion, largest with that of the other axis."""
MASS_DECADES, NEARER_DECADES = 1.5, 1.0
"""Largest distance of the mass from exchanged channels to that of the model, in decades, and by how much the
mass from the channels as read must be farther off.
"""
LEAST_ROUGHNESS_RATIO = 10.0
"""Roughness of a position over that of its force, from which on the two are exchanged whatever a fit shows.

A position is its force integrated twice: on the measured axes of the examples it is 2 to 7000 times smoother.
"""
ROUGHNESS_S = 1e-2
"""Time between the samples of a second difference; over shorter times it shows counts of an encoder."""
MOST_EXCHANGED_RESIDUAL = 0.5
"""Largest residual share of the variance with exchanged channels."""


def is_unsigned(columns: RigidColumns) -> bool:
    """Return whether the force of an axis that is driven both ways has lost its sign."""
    force_n = columns.force_n
    low, high = float(force_n.min()), float(force_n.max())
    if min(-low, high) > LARGEST_OTHER_SIGN * max(-low, high):
        return False
    size_n = np.abs(force_n)
    as_read = _residual_squares(columns.matrix, force_n)
    best, turned = np.inf, 0.0
    for start in (columns.velocity, columns.acceleration):
        sign = np.sign(start)
        for _ in range(ITERATIONS):
            fitted = columns.matrix @ _fitted(columns.matrix, sign * size_n)
            sign = np.where(fitted < 0.0, -1.0, 1.0)
        squares = float(np.sum((sign * size_n - fitted) ** 2))
        if squares < best:
            best, turned = squares, min(float(np.mean(sign < 0.0)), float(np.mean(sign > 0.0)))
    return best < UNSIGNED_RATIO * as_read and turned > LEAST_TURNED_SHARE


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
    of_position, of_force = (
        _roughness(of, recording.period_s) for of in (recording.motor_m, recording.force_n)
    )
    if (
        of_position > LEAST_ROUGHNESS_RATIO * of_force
    ):  # gravity and standstill hide mass and friction from any fit
        return nearest
    if fit.residual_share > MOST_EXCHANGED_RESIDUAL:
        return None
    # the work of a cycle changes its sign with the exchange: friction would drive
    if fit.friction_w <= 0.0 or as_read.friction_w >= 0.0 or fit.mass_kg <= 0.0:
        return None
    off = _decades(fit.mass_kg / nearest**2, mass_kg)
    is_nearer = off < MASS_DECADES and off + NEARER_DECADES < _decades(as_read.mass_kg, mass_kg)
    return nearest if is_nearer else None


def _roughness(values: Array, period_s: float) -> float:
    """Return the RMS second difference over ROUGHNESS_S of a channel (n,), over its standard deviation."""
    step = max(round(ROUGHNESS_S / period_s), 1)
    second = values[2 * step :] - 2.0 * values[step:-step] + values[: -2 * step]
    return float(np.sqrt(np.mean(second**2)) / max(float(np.std(values)), 1e-300))


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
                finding = SensorFinding(
                    check="exchanged",
                    severity="unusable",
                    source=one.source,
                    axis=one.axis,
                    channel="force_n",
                    start_s=one.start_s,
                    end_s=one.start_s + one.time_s[-1],
                    size=1.0,
                    unit="1",
                    message=message,
                    remedy=remedy,
                )
                yield finding, other.axis


def _after_axis(entry: str) -> str:
    return entry.partition(".")[2]


def _explain_each_other(one: AxisRecording, other: AxisRecording) -> bool:
    def share(motion: AxisRecording, force: AxisRecording) -> float:
        columns = rigid_columns(motion.motor_m, force.force_n, motion.period_s)
        if columns is None:
            return 1.0
        force_n = columns.force_n - columns.force_n.mean()
        return _residual_squares(columns.matrix, columns.force_n) / max(float(force_n @ force_n), 1e-300)

    own, crossed = ((one, one), (other, other)), ((one, other), (other, one))
    return all(share(*pair) > LEAST_OWN_RESIDUAL for pair in own) and all(
        share(*pair) < MOST_CROSSED_RESIDUAL for pair in crossed
    )


def _fitted(matrix: Array, values: Array) -> Array:
    """Return the coefficients (k,) of a least-squares fit."""
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    found: Array = np.linalg.lstsq(matrix / scale, values, rcond=1e-6)[0] / scale
    return found


def _residual_squares(matrix: Array, values: Array) -> float:
    """Return the residual sum of squares of a least-squares fit."""
    residual = values - matrix @ _fitted(matrix, values)
    return float(residual @ residual)
