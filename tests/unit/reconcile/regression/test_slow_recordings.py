"""At 100 Hz a second difference is off above ten hertz: what it is off by must not pass for a force."""

import numpy as np
import pytest
from known_axis import AXIS, MASS_KG

from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.recording.kinematics import kinematics
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.regression_data import low_pass_of, target_and_baseline
from reconcile.regression.state_filter import StateFilter

FREQUENCIES_HZ = (1.0, 14.0)


def data(period_s: float) -> RegressionData:
    t = np.arange(round(20.0 / period_s)) * period_s
    angles = [2.0 * np.pi * hz for hz in FREQUENCIES_HZ]
    position_m = sum(0.02 / w**2 * np.sin(w * t) for w in angles)
    force_n = -sum(0.02 * MASS_KG * np.sin(w * t) for w in angles)
    return RegressionData(
        period_s, t, kinematics(position_m, period_s), force_n, force_n, AXIS.lead_m, 0.0, None, None, {}
    )


def share_left(target: np.ndarray, column: np.ndarray) -> float:
    inner = slice(len(target) // 10, -len(target) // 10)
    column, target = column[inner], target[inner]
    left = target - column * (column @ target) / (column @ column)
    return float(np.sqrt(np.mean(left**2) / np.mean(target**2)))


@pytest.mark.parametrize("period_s", [1e-3, 1e-2])
def test_a_mass_leaves_nothing_at_any_rate(period_s: float) -> None:
    one = data(period_s)
    target, base = target_and_baseline(one, ResidualChannel.FORCE)
    assert share_left(target, base[:, 0]) < 0.01


def test_the_filter_alone_would_leave_a_force_at_100_hertz() -> None:
    one = data(1e-2)
    alone = StateFilter(1e-2, FILTER_HZ)
    assert share_left(alone(one.force_n), alone(one.motion.position_m, 2)) > 0.03
    assert low_pass_of(one) is not alone
