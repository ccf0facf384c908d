"""Presliding of the model along a recorded motion, against Dahl's and LuGre's closed forms."""

import numpy as np
import pytest

from hil_sim.physics.friction import presliding_lugre, stribeck_friction
from reconcile.formats.nominal_axis import ModelEffects
from reconcile.recording.kinematics import Kinematics, kinematics
from reconcile.regression.model_presliding import presliding_n

T = 1e-3
STIFFNESS_N_M, COULOMB_N, SPEED_M_S = 2e6, 10.0, 0.01
LUGRE = presliding_lugre.Params(STIFFNESS_N_M, 0.0)


def ramp(speed_m_s: float = SPEED_M_S) -> Kinematics:
    return kinematics(speed_m_s * np.maximum(np.arange(2000) * T - 0.5, 0.0), T)


def held(**effects: object) -> ModelEffects:
    return ModelEffects(dict(effects), {})


def test_without_a_presliding_law_there_is_none() -> None:
    assert presliding_n(held(), COULOMB_N, ramp(), T) is None


def test_in_sliding_presliding_friction_equals_its_level() -> None:
    found = presliding_n(held(presliding_lugre=LUGRE), COULOMB_N, ramp(), T)
    assert found is not None
    assert found[1500:] == pytest.approx(0.0, abs=1e-6)


def test_the_bristle_deflection_follows_dahls_model() -> None:
    """F = g (1 - exp(-sigma0 x / g)), so that g exp(-sigma0 x / g) of the level is missing, at any speed."""
    for speed_m_s in (0.002, 0.01):
        motion = ramp(speed_m_s)
        found = presliding_n(held(presliding_lugre=LUGRE), COULOMB_N, motion, T)
        assert found is not None
        travel_m = np.concatenate(
            ([0.0], np.cumsum(0.5 * T * np.abs(motion.velocity_m_s[1:] + motion.velocity_m_s[:-1])))
        )
        bending = motion.moving & (travel_m < 3.0 * COULOMB_N / STIFFNESS_N_M) & (motion.direction > 0.0)
        assert bending.any()
        missing_n = COULOMB_N * np.exp(-STIFFNESS_N_M * travel_m / COULOMB_N)
        assert found[bending] == pytest.approx(-missing_n[bending], abs=0.02 * COULOMB_N)


def test_the_level_has_stribecks_rise_at_the_speed() -> None:
    """The steady force less its level is nothing, with the rise as without: it is in the level."""
    rise = stribeck_friction.Params(5.0, 0.02)
    found = presliding_n(held(presliding_lugre=LUGRE, stribeck_friction=rise), COULOMB_N, ramp(), T)
    plain = presliding_n(held(presliding_lugre=LUGRE), COULOMB_N, ramp(), T)
    assert found is not None
    assert plain is not None
    assert found[1500:] == pytest.approx(0.0, abs=1e-6)
    start = int(np.flatnonzero(ramp().direction > 0.0)[0])
    assert found[start] < plain[start] - 0.5  # more of a higher level is missing at first
