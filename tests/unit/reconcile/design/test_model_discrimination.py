"""Expected evidence against plain least squares on all samples, and noise whose correlation is known."""

import numpy as np
import pytest
from known_axis import AXIS, explanation_of, identified_effect, motion_m, regression_data_of
from scipy.signal import lfilter

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.design.model_discrimination import AssumedTerm, ModelDiscrimination, residual_noise
from reconcile.design.predicted_data import predicted_data
from reconcile.design.recorded_axis import recorded_axis
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.regression_data import OVERSAMPLING
from reconcile.regression.regression_problem import regression_problem

STRIBECK, SQUARE = ("stribeck_friction", (4e-3,)), ("quadratic_viscous_friction", ())
FOUND = identified_effect(*STRIBECK, 3.0)
RECORDED = explanation_of([motion_m("sine"), motion_m("dwells")], [FOUND])
MOTION = regression_data_of(motion_m("slow speeds"), [FOUND])
STRIDE = int(1.0 / (1e-3 * OVERSAMPLING * FILTER_HZ))


def kept(datasets: list, term: tuple) -> list[np.ndarray]:
    """Return filtered samples (n, columns) of a model with one term by recording; the force is column 0."""
    found = regression_problem(datasets, ResidualChannel.FORCE, [term], only=True)
    target_and_columns = [found.target_and_columns(k) for k in range(len(datasets))]
    return [
        np.column_stack((y, columns))[used][::STRIDE]
        for (y, columns), used in zip(target_and_columns, found.used, strict=True)
    ]


def left(design: np.ndarray, y: np.ndarray) -> float:
    theta, *_ = np.linalg.lstsq(design, y, rcond=None)
    return float(np.sum((y - design @ theta) ** 2))


def test_gain_is_the_difference_of_joint_least_squares_residuals() -> None:
    discrimination = ModelDiscrimination(RECORDED.residuals, ResidualChannel.FORCE, [], [STRIBECK, SQUARE])
    got = discrimination.expected_gain([(STRIBECK,)], [(SQUARE,)], discrimination.motion_products(MOTION))
    datasets = [*(residual.data for residual in RECORDED.residuals), MOTION]
    true, rival = kept(datasets, STRIBECK), kept(datasets, SQUARE)
    here = np.concatenate(true[:-1])
    theta, *_ = np.linalg.lstsq(here[:, 1:], here[:, 0], rcond=None)
    predicted = [part[:, 1:] @ theta for part in true]
    before = left(np.concatenate(rival[:-1])[:, 1:], np.concatenate(predicted[:-1]))
    after = left(np.concatenate(rival)[:, 1:], np.concatenate(predicted))
    noise = residual_noise(RECORDED.residuals)
    assert got == pytest.approx(
        (after - before) / (2.0 * noise.variance * noise.correlation_samples), rel=1e-4
    )
    assert got > 100.0


def test_same_model_gains_nothing_over_itself() -> None:
    discrimination = ModelDiscrimination(RECORDED.residuals, ResidualChannel.FORCE, [], [STRIBECK])
    assert (
        discrimination.expected_gain([(STRIBECK,)], [(STRIBECK,)], discrimination.motion_products(MOTION))
        < 1e-3
    )


def test_evidence_grows_with_the_square_of_the_effect_size() -> None:
    discrimination = ModelDiscrimination(RECORDED.residuals, ResidualChannel.FORCE, [], [STRIBECK, SQUARE])
    products = discrimination.motion_products(MOTION)
    small, large = (
        discrimination.evidence_of_term(AssumedTerm(STRIBECK, (size,)), (), products) for size in (1.0, 3.0)
    )
    assert large == pytest.approx(9.0 * small, rel=1e-3)
    assert discrimination.evidence_of_term(AssumedTerm(STRIBECK, (1.0,)), (), None) < small


def test_correlation_time_is_that_of_the_noise() -> None:
    rng, keep = np.random.default_rng(3), 0.8
    values = lfilter([1.0], [1.0, -keep], rng.normal(size=400_000))
    residual = RECORDED.residuals[0]
    everywhere = np.ones(len(values), dtype=np.bool_)
    noise = residual_noise(
        [residual._replace(after=np.repeat(values, STRIDE), used=np.repeat(everywhere, STRIDE))]
    )
    assert noise.correlation_samples == pytest.approx((1.0 + keep) / (1.0 - keep), rel=0.1)
    assert noise.variance == pytest.approx(1.0 / (1.0 - keep**2), rel=0.03)


def test_planned_motion_gives_the_regression_data_of_its_recording() -> None:
    """Planned positions give the same kinematics as measured ones, and nearly the same evidence."""
    seen = recorded_axis([RECORDED], AXIS)
    planned = predicted_data(motion_m("slow speeds"), 1e-3, RECORDED.residuals[0].data, seen)
    discrimination = ModelDiscrimination(RECORDED.residuals, ResidualChannel.FORCE, [], [STRIBECK, SQUARE])
    nats = [
        discrimination.expected_gain([(STRIBECK,)], [(SQUARE,)], discrimination.motion_products(data))
        for data in (planned, MOTION)
    ]
    assert nats[0] == pytest.approx(nats[1], rel=0.05)
    assert np.mean(planned.motion.moving == MOTION.motion.moving) > 0.98
