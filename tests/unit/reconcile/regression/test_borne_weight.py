"""A weight that a motor bears is part of its force, and a ripple of the torque shows in it."""

import numpy as np
import pytest
from formula_residuals import COULOMB_N, data

from reconcile.catalogue.torque_ripple import ENTRY
from reconcile.regression.regression_data import with_model_force

RIPPLE, HARMONIC = 0.06, 2.0


def test_a_ripple_of_the_torque_is_seen_in_the_weight() -> None:
    bare, weight_n = data(), 20.0 * COULOMB_N
    wave = np.sin(HARMONIC * 2.0 * np.pi * bare.motion.position_m / bare.lead_m)
    one = with_model_force(bare._replace(force_n=(bare.force_n + weight_n) * (1.0 + RIPPLE * wave)))
    assert one.model_force_n.mean() == pytest.approx(weight_n, rel=0.05)
    columns = ENTRY.terms[0].columns(one, (HARMONIC,))
    left = one.force_n - one.model_force_n
    theta, *_ = np.linalg.lstsq(columns, left, rcond=None)
    assert theta == pytest.approx([RIPPLE, 0.0], abs=0.1 * RIPPLE)
    assert np.std(left - columns @ theta) < 0.3 * np.std(left)


def test_a_mean_below_friction_is_no_weight() -> None:
    bare, mean_n = with_model_force(data()), 0.5 * COULOMB_N
    one = with_model_force(data()._replace(force_n=data().force_n + mean_n))
    assert one.model_force_n.mean() == pytest.approx(bare.model_force_n.mean(), abs=0.02 * COULOMB_N)
    assert (one.load_n - bare.load_n).mean() == pytest.approx(mean_n, rel=0.02)
