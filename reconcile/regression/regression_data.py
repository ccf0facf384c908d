"""From a recording to the data of a regression: kinematics, force of a model, and what is filtered alike."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from kernels.arrays import Array
from reconcile.catalogue import gravity, presliding_hysteresis
from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.catalogue.periodic import pair
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.recording.gaussian_low_pass import gaussian_low_pass
from reconcile.recording.kinematics import gaussian_width_s, kinematics
from reconcile.recording.recording import AxisRecording
from reconcile.recording.time_column import SLOW_CORNER_SHARE, SLOW_RATE_HZ
from reconcile.regression.filter_ends import FILTER_HZ, ends
from reconcile.regression.model_presliding import presliding_n
from reconcile.regression.noisy_acceleration import motion_of
from reconcile.regression.set_point_jumps import force_without_teeth_n
from reconcile.regression.state_filter import StateFilter
from reconcile.regression.thinning import thinned, thinned_kinematics

LEAST_CLEAN_HZ = 150.0
"""Corner of the kinematics below which their low pass is applied to both sides of the regression."""
OVERSAMPLING = 4.0
"""Rate of the kept samples over the filter's bandwidth; samples in between add no information."""
BUILD_UP_EXPONENTS = (0.0, 1.0)
"""Dahl's exponents of the presliding that is tried beside the rigid model."""
LEAST_BUILD_UP_SHARE = 0.1
"""Least share of the rigid model's squared residual that this presliding explains. Chosen."""
STICKING_WIDTH_S = 1e-3
"""Standard deviation, s, of the Gaussian over the force that gives the friction of a sticking axis."""


def regression_data(recording: AxisRecording, axis: NominalAxis) -> RegressionData:
    """Compute what columns need of a recording: kinematics, forces of the model, masses."""
    count = recording.samples_in_a_mean
    others = {
        name: thinned_kinematics(kinematics(values, recording.period_s), count)
        for name, values in recording.others.items()
    }
    return with_model_force(thinned(_alone(recording, axis), count)._replace(others=others))


def _alone(recording: AxisRecording, axis: NominalAxis) -> RegressionData:
    """The data at the full rate, without the other axes."""
    motion, force_n = motion_of(recording, axis.mass_kg), force_without_teeth_n(recording, axis)
    law_n = presliding_n(axis.model_effects, axis.coulomb_n, motion, recording.period_s)
    return RegressionData(
        period_s=recording.period_s,
        time_s=recording.time_s - recording.time_s[0],
        motion=motion,
        force_n=force_n,
        recorded_force_n=None if force_n is recording.force_n else recording.force_n,
        model_force_n=force_n,
        lead_m=axis.lead_m,
        motor_mass_kg=axis.motor_mass_kg,
        scale_m=recording.scale_m,
        temperature_k=recording.temperature_k,
        others={},
        presliding_law_n=0.0 if law_n is None else law_n,
        rotary=axis.rotary,
    )


def with_model_force(data: RegressionData) -> RegressionData:
    """Set the force of a rigid model, fitted to this recording, and the direction of friction.

    Where the axis sticks, friction balances the measured force: its direction is a share of the Coulomb
    level, between -1 and 1.
    """
    m = data.motion
    y, rigid = target_and_baseline(data, ResidualChannel.FORCE)
    used = samples_in_use(data, ResidualChannel.FORCE)
    forces_at_rest = filtered = np.ones((len(y), 1))
    if gravity.range_rad([data]) >= gravity.LEAST_RANGE_RAD:  # a joint carries a weight
        turning = pair(m.position_m)
        filtered = np.concatenate((forces_at_rest, low_pass_of(data)(turning)), axis=1)
        forces_at_rest = np.concatenate((forces_at_rest, turning), axis=1)
    rigid = np.concatenate((rigid, filtered), axis=1)
    fitted, *_ = np.linalg.lstsq(rigid[used], y[used], rcond=None)
    mass_kg, viscous_n_s_m, coulomb_n = (float(value) for value in fitted[:3])
    weight_n = forces_at_rest @ fitted[3:]
    frictionless_n = mass_kg * m.acceleration_m_s2 + viscous_n_s_m * m.velocity_m_s
    direction = friction_direction(data, frictionless_n + weight_n, max(coulomb_n, 1e-9))
    # a weight below the level of friction may be a sensor's offset, or friction that differs by direction
    has_weight = float(np.abs(weight_n).max()) > coulomb_n
    build_up_n = _build_up_n(data, rigid, y - rigid @ fitted, used, direction)
    return data._replace(
        motion=m._replace(direction=direction),
        model_force_n=frictionless_n
        + coulomb_n * direction
        + build_up_n
        + data.presliding_law_n
        + (weight_n if has_weight else 0.0),
        load_n=(mass_kg - data.motor_mass_kg) * m.acceleration_m_s2 + weight_n,
    )


def _build_up_n(
    data: RegressionData, rigid: Array, residual_n: Array, used: NDArray[np.bool_], direction: Array
) -> Array:
    """Force (n,) that presliding adds to a rigid model; 0 where it explains little of the model's residual.

    Without it, a delay or a torque constant would be fitted to a model force that jumps where friction builds
    up. `rigid`: the model's filtered columns (n, k); `residual_n`: its filtered residual (n,).
    """
    kept = np.flatnonzero(used)[:: stride(data.period_s)]
    base, target_n = rigid[kept], residual_n[kept]
    projection = np.linalg.pinv(base.T @ base) @ base.T
    low_pass, family = low_pass_of(data), presliding_hysteresis.ENTRY.terms[0]
    most_explained, build_up_n = LEAST_BUILD_UP_SHARE * float(target_n @ target_n), np.zeros(len(direction))
    for shape in (shape for shape in family.shapes([data]) if shape[1] in BUILD_UP_EXPONENTS):
        column = family.columns(data, shape)[:, 0]
        filtered = low_pass(column)[kept]
        filtered = filtered - base @ (projection @ filtered)
        level_n = float(filtered @ target_n) / max(float(filtered @ filtered), 1e-300)
        explained = level_n * float(filtered @ target_n)
        if level_n > 0.0 and explained > most_explained:
            most_explained, build_up_n = explained, level_n * (column + data.motion.direction - direction)
    return build_up_n


def friction_direction(data: RegressionData, frictionless_n: Array, level_n: Array | float) -> Array:
    """Direction of friction (n,): of motion; where the axis sticks, the share of `level_n` that holds it."""
    measured_n = gaussian_filter1d(data.force_n - data.presliding_law_n, STICKING_WIDTH_S / data.period_s)
    share = np.clip((measured_n - frictionless_n) / level_n, -1.0, 1.0)
    return np.where(data.motion.moving, data.motion.direction, share)


def stride(period_s: float) -> int:
    """Distance of the kept samples, in samples."""
    return max(int(1.0 / (period_s * OVERSAMPLING * FILTER_HZ)), 1)


def low_pass_of(data: RegressionData) -> Callable[..., Array]:
    """The state filter; where positions are noisy, after the low pass of their derivatives."""
    state_filter = StateFilter(data.period_s, FILTER_HZ)
    corner_hz = _low_pass_hz(data)
    if corner_hz is None:
        return state_filter
    width = gaussian_width_s(corner_hz) / data.period_s
    return lambda signal, derivative=0: state_filter(gaussian_low_pass(signal, width), derivative)


def _low_pass_hz(data: RegressionData) -> float | None:
    """Corner of the low pass before the state filter; None where positions are clean."""
    corner_hz = data.motion.corner_hz
    if 1.0 / data.period_s < SLOW_RATE_HZ:
        corner_hz = min(corner_hz, SLOW_CORNER_SHARE / data.period_s)
    return corner_hz if corner_hz < LEAST_CLEAN_HZ else None


def target_and_baseline(data: RegressionData, channel: ResidualChannel) -> tuple[Array, Array]:
    """Target (n,) and the columns of the baseline parameters (n, k), filtered alike."""
    m = data.motion
    low_pass = low_pass_of(data)
    if channel is ResidualChannel.FORCE:
        base = [low_pass(m.position_m, 2), low_pass(m.position_m, 1), low_pass(m.direction)]
        return low_pass(data.force_n - data.presliding_law_n), np.stack(base, axis=1)
    assert data.scale_m is not None  # noqa: S101  # the deviation exists only with a scale
    delayed = low_pass(m.position_m, 1)
    return low_pass(data.scale_m - m.position_m), np.stack((np.ones(len(delayed)), delayed), axis=1)


def samples_in_use(data: RegressionData, channel: ResidualChannel) -> NDArray[np.bool_]:
    """Samples (n,) after the filter has settled; in the force only those in motion.

    The low pass of noisy positions holds their first and last value beyond the ends, as no axis does: what it
    reaches of that is left out.
    """
    used = ~ends(len(data.time_s), data.period_s, _low_pass_hz(data))
    if channel is ResidualChannel.FORCE:
        used &= data.motion.moving
    return used
