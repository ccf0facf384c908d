"""Expected evidence against plain least squares on all samples, and noise whose correlation is known."""

from __future__ import annotations

import numpy as np
import pytest
from made_up_axis import AXIS, finding, made_up, recording, scene_over
from scipy.signal import lfilter

from reconcile.catalogue.kinds import Sense
from reconcile.expected_evidence import Sized, Weighing, noise_of
from reconcile.next_experiment_recorded import recorded
from reconcile.next_experiment_scene import scene_to_come
from reconcile.scenes import FILTER_HZ, OVERSAMPLING, difference

STRIBECK, SQUARE = ("stribeck_friction", (4e-3,)), ("quadratic_viscous_friction", ())
FOUND = finding(*STRIBECK, 3.0)
RECORDED = made_up([recording("sine"), recording("dwells")], [FOUND])
MOTION = scene_over(recording("slow speeds"), [FOUND])
STRIDE = int(1.0 / (1e-3 * OVERSAMPLING * FILTER_HZ))


def kept(scenes: list, term: tuple) -> list[np.ndarray]:
    """Filtered samples (n, columns) of a model with one term, the measured force first, by scene."""
    found = difference(scenes, Sense.FORCE, [term], only=True)
    sides = [found.sides(k) for k in range(len(scenes))]
    return [
        np.column_stack((y, columns))[used][::STRIDE]
        for (y, columns), used in zip(sides, found.used, strict=True)
    ]


def left(design: np.ndarray, y: np.ndarray) -> float:
    theta, *_ = np.linalg.lstsq(design, y, rcond=None)
    return float(np.sum((y - design @ theta) ** 2))


def test_gain_is_what_least_squares_over_recordings_and_motion_leaves_more() -> None:
    weighing = Weighing(RECORDED.rests, Sense.FORCE, [], [STRIBECK, SQUARE])
    got = weighing.gained([(STRIBECK,)], [(SQUARE,)], weighing.products(MOTION))
    scenes = [*(rest.scene for rest in RECORDED.rests), MOTION]
    true, rival = kept(scenes, STRIBECK), kept(scenes, SQUARE)
    here = np.concatenate(true[:-1])
    theta, *_ = np.linalg.lstsq(here[:, 1:], here[:, 0], rcond=None)
    predicted = [part[:, 1:] @ theta for part in true]
    before = left(np.concatenate(rival[:-1])[:, 1:], np.concatenate(predicted[:-1]))
    after = left(np.concatenate(rival)[:, 1:], np.concatenate(predicted))
    noise = noise_of(RECORDED.rests)
    assert got == pytest.approx((after - before) / (2.0 * noise.variance * noise.tau), rel=1e-4)
    assert got > 100.0


def test_same_model_gains_nothing_over_itself() -> None:
    weighing = Weighing(RECORDED.rests, Sense.FORCE, [], [STRIBECK])
    assert weighing.gained([(STRIBECK,)], [(STRIBECK,)], weighing.products(MOTION)) < 1e-3


def test_evidence_of_what_is_hidden_grows_with_the_square_of_its_size() -> None:
    weighing = Weighing(RECORDED.rests, Sense.FORCE, [], [STRIBECK, SQUARE])
    products = weighing.products(MOTION)
    small, large = (weighing.hidden(Sized(STRIBECK, (size,)), (), products) for size in (1.0, 3.0))
    assert large == pytest.approx(9.0 * small, rel=1e-3)
    assert weighing.hidden(Sized(STRIBECK, (1.0,)), (), None) < small


def test_correlation_time_is_that_of_the_noise() -> None:
    rng, keep = np.random.default_rng(3), 0.8
    values = lfilter([1.0], [1.0, -keep], rng.normal(size=400_000))
    rest = RECORDED.rests[0]
    everywhere = np.ones(len(values), dtype=np.bool_)
    noise = noise_of([rest._replace(after=np.repeat(values, STRIDE), used=np.repeat(everywhere, STRIDE))])
    assert noise.tau == pytest.approx((1.0 + keep) / (1.0 - keep), rel=0.1)
    assert noise.variance == pytest.approx(1.0 / (1.0 - keep**2), rel=0.03)


def test_motion_to_come_is_seen_as_the_recording_of_it_would_be() -> None:
    """Planned positions tell the same kinematics as sensed ones, and about the same evidence."""
    seen = recorded([RECORDED], AXIS)
    planned = scene_to_come(recording("slow speeds"), 1e-3, RECORDED.rests[0].scene, seen)
    weighing = Weighing(RECORDED.rests, Sense.FORCE, [], [STRIBECK, SQUARE])
    nats = [
        weighing.gained([(STRIBECK,)], [(SQUARE,)], weighing.products(scene)) for scene in (planned, MOTION)
    ]
    assert nats[0] == pytest.approx(nats[1], rel=0.05)
    assert np.mean(planned.motion.moving == MOTION.motion.moving) > 0.98
