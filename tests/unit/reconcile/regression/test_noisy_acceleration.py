"""The bandwidth of a recording whose acceleration is noisy: a rigid mass is the same in each."""

import numpy as np
import pytest
from known_axis import AXIS

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.recording.kinematics import gaussian_width_s
from reconcile.recording.recording import AxisRecording
from reconcile.regression.regression_data import regression_data, samples_in_use, target_and_baseline

T, N = 2e-3, 6000
INERTIA_KG_M2, COULOMB_NM = 0.05, 0.1
JITTER_S = 4e-4


def recorded(jitter_s: float) -> AxisRecording:
    """A joint whose encoder is read early or late by a random part of a sample."""
    rng, t = np.random.default_rng(5), np.arange(N) * T

    def angle(at_s: Array) -> Array:
        return 0.8 * np.sin(6.0 * at_s) + 0.4 * np.sin(14.0 * at_s)

    w = 4.8 * np.cos(6.0 * t) + 5.6 * np.cos(14.0 * t)
    a = -28.8 * np.sin(6.0 * t) - 78.4 * np.sin(14.0 * t)
    torque = INERTIA_KG_M2 * a + COULOMB_NM * np.sign(w) + rng.normal(size=N) * 5e-3
    read = angle(t + jitter_s * rng.normal(size=N))
    counted = np.round(read / 4e-4) * 4e-4
    return AxisRecording("r", "j", T, t, counted, torque, None, None, None, {})


def mass_kg(recording: AxisRecording) -> float:
    data = regression_data(recording, AXIS._replace(rotary=True))
    y, base = target_and_baseline(data, ResidualChannel.FORCE)
    theta, *_ = np.linalg.lstsq(base[200:-200], y[200:-200], rcond=None)
    return float(theta[0])


def test_jitter_of_the_stamps_does_not_hide_the_mass() -> None:
    assert mass_kg(recorded(JITTER_S)) == pytest.approx(INERTIA_KG_M2, rel=0.12)
    data = regression_data(recorded(JITTER_S), AXIS)
    assert data.motion.corner_hz < 45.0


def test_a_recording_that_ends_in_motion_does_not_hide_the_mass() -> None:
    """A low pass holds the last position beyond the end, as if the joint stopped at once."""
    rng, t = np.random.default_rng(5), np.arange(N) * T
    read_s = t + JITTER_S * rng.normal(size=N)
    angle = 0.15 * read_s**2 + 0.033 * np.sin(3.0 * read_s)
    torque = INERTIA_KG_M2 * (0.3 - 0.3 * np.sin(3.0 * t)) + COULOMB_NM + rng.normal(size=N) * 2e-4
    counted = np.round(angle / 4e-4) * 4e-4
    ends_fast = AxisRecording("r", "j", T, t, counted, torque, None, None, None, {})
    assert mass_kg(ends_fast) == pytest.approx(INERTIA_KG_M2, rel=0.12)


def test_a_clean_recording_keeps_its_bandwidth() -> None:
    clean = recorded(0.0)
    assert regression_data(clean, AXIS).motion.corner_hz >= 45.0


def test_the_ends_that_the_low_pass_reaches_judge_nothing() -> None:
    noisy, clean = (regression_data(recorded(jitter_s), AXIS) for jitter_s in (JITTER_S, 0.0))
    for channel in (ResidualChannel.FORCE, ResidualChannel.POSITION_DEVIATION):
        used = samples_in_use(noisy, channel)
        sigma_s = gaussian_width_s(noisy.motion.corner_hz)
        first, last = np.flatnonzero(used)[[0, -1]]
        assert min(first, N - 1 - last) * T > 2.9 * sigma_s
    # beyond the ends the low pass holds the motion still: the force would lack what accelerates the joint
    y, base = target_and_baseline(noisy, ResidualChannel.FORCE)
    left = np.abs(y - base @ np.array([INERTIA_KG_M2, 0.0, COULOMB_NM]))
    used = samples_in_use(noisy, ResidualChannel.FORCE)
    assert left[used].max() < 0.7 * max(left[:10].max(), left[-10:].max())
    assert samples_in_use(clean, ResidualChannel.POSITION_DEVIATION).sum() >= 0.95 * N
