"""Kinematics behind a low pass at which the noise of the acceleration does not hide the mass.

A rigid mass is the same in every bandwidth; noise in its acceleration makes the fitted one smaller, the more
the wider (errors in variables). Jitter of the stamps, coarse encoders, vibration of the frame and gears are
such noise, and only the force shows it. So the highest corner that shows nearly all of the mass is taken.

What another joint of a robot needs at this one hides the mass as well: where its coupling explains most of
what remains, the mass is fitted beside it.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from reconcile.catalogue.joint_coupling import PLACES, Derivatives, coupled
from reconcile.recording.gaussian_low_pass import gaussian_low_pass
from reconcile.recording.kinematics import (
    LARGEST_NOISE_SHARE,
    Kinematics,
    acceleration_noise_m_s2,
    gaussian_width_s,
    kinematics,
)
from reconcile.recording.recording import AxisRecording
from reconcile.regression.filter_ends import ends

NOISY_HZ = 80.0
"""Corner of the kinematics at or below which their acceleration may hide the mass, and is checked. Chosen."""
LOWERED_CORNERS_HZ = (30.0, 20.0, 14.0, 10.0, 7.0, 5.0)
"""Lower corners to try then, the highest first; a recording of seconds has little below the last."""
COUPLED_CORNER_HZ = 3.5
"""One more beside a coupling: where a joint swings freely, large forces cancel and their noise remains."""
LEAST_MASS_RATIO = 0.9
"""Least mass behind a low pass over the largest of all low passes; chosen: noise may hide a tenth of it."""
COLLINEAR_RATIO = 1e-5
"""Singular value of columns of unit size, over the largest, below which they count as collinear."""
COUPLED_SHARE = 0.75
"""Largest share of the squares that a coupling of joints leaves where it is taken into account. Chosen: by
chance its five columns explain a tenth; of two measured robots they leave 0.01 to 0.72."""


class _MassFit(NamedTuple):
    """The fit of a mass behind a low pass."""

    mass_kg: float
    residual_squares: float
    """Of the force, N^2."""


def motion_of(recording: AxisRecording, nominal_kg: float) -> Kinematics:
    """Kinematics of a recorded axis of about `nominal_kg`, with the corner that shows nearly all of its mass.

    All corners are compared without the ends that the lowest one falsifies: a stop in the last sample would
    outweigh the motion before it.
    """
    motion = kinematics(recording.motor_m, recording.period_s)
    if motion.corner_hz > NOISY_HZ:
        return motion
    noise_n = nominal_kg * acceleration_noise_m_s2(recording.motor_m, recording.period_s, motion.corner_hz)
    hides_mass = noise_n > LARGEST_NOISE_SHARE * float(np.std(recording.force_n))
    corners_hz = [motion.corner_hz, *(hz for hz in LOWERED_CORNERS_HZ if hz < motion.corner_hz)]
    beside = own = _own_columns(recording, motion)
    if hides_mass:
        beside = _with_coupling(recording, motion, own)
    if beside is not own:
        corners_hz.append(COUPLED_CORNER_HZ)
    used = _used(motion, recording.period_s, corners_hz[-1])
    masses_kg = [_mass(recording, hz, beside, used).mass_kg for hz in corners_hz]
    largest_kg = max(masses_kg)
    if largest_kg > 0.0:
        chosen = next(k for k, mass_kg in enumerate(masses_kg) if mass_kg >= LEAST_MASS_RATIO * largest_kg)
    else:  # forces that cancel, as of a joint that swings freely: only the noise tells
        chosen = -1 if hides_mass else 0
    return kinematics(recording.motor_m, recording.period_s, corners_hz[chosen]) if chosen else motion


def _with_coupling(recording: AxisRecording, motion: Kinematics, own: Array) -> Array:
    """The columns (n, k) with those of the other joint that explains most of the rest, if one does."""
    used = _used(motion, recording.period_s, COUPLED_CORNER_HZ)

    def residual_squares(columns: Array) -> float:
        return _mass(recording, COUPLED_CORNER_HZ, columns, used).residual_squares

    least, chosen = COUPLED_SHARE * residual_squares(own), own
    for coupling in _couplings(recording):
        columns = np.concatenate((own, coupling), axis=1)
        squares = residual_squares(columns)
        if squares < least:
            least, chosen = squares, columns
    return chosen


def _own_columns(recording: AxisRecording, motion: Kinematics) -> Array:
    """(n, 6): friction, and forces that depend on the position."""
    x = motion.position_m - motion.position_m.mean()
    v = np.gradient(x, recording.period_s)
    return np.stack((v, motion.direction, np.ones(len(x)), x, np.sin(x), np.cos(x)), axis=1)


def _couplings(recording: AxisRecording) -> Iterator[Array]:
    """Columns of the inertia and of the weight of another joint, at either place in the chain."""
    own = _derivatives(recording.motor_m, recording.period_s)
    for name in sorted(recording.others):
        other = _derivatives(recording.others[name], recording.period_s)
        angle = own[0] + other[0]
        for place in PLACES:
            yield np.column_stack((coupled(own, other, place), np.sin(angle), np.cos(angle)))


def _derivatives(position_m: Array, period_s: float) -> Derivatives:
    """Position, velocity and acceleration, with all their noise: the low pass is applied to the columns."""
    velocity_m_s = np.gradient(position_m, period_s)
    return position_m, velocity_m_s, np.gradient(velocity_m_s, period_s)


def _used(motion: Kinematics, period_s: float, lowest_hz: float) -> NDArray[np.bool_]:
    """Samples (n,) in motion, without the ends that the lowest corner falsifies."""
    return motion.moving & ~ends(len(motion.moving), period_s, lowest_hz)


def _mass(recording: AxisRecording, corner_hz: float, beside: Array, used: NDArray[np.bool_]) -> _MassFit:
    """Fit the mass behind a low pass, beside columns (n, k), to the used samples."""
    position_m, period_s = recording.motor_m, recording.period_s
    width = gaussian_width_s(corner_hz) / period_s

    def smooth(values: Array) -> Array:
        return gaussian_low_pass(values, width)[used]

    a = np.gradient(np.gradient(position_m - position_m.mean(), period_s), period_s)
    columns, force_n = smooth(np.column_stack((a, beside))), smooth(recording.force_n)
    scale = np.linalg.norm(columns, axis=0) + 1e-300
    theta, *_ = np.linalg.lstsq(columns / scale, force_n, rcond=COLLINEAR_RATIO)
    residual_n = force_n - columns / scale @ theta
    return _MassFit(float(theta[0] / scale[0]), float(residual_n @ residual_n))
