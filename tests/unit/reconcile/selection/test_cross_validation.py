"""Gains and resampled fits from products of columns are those of the samples."""

import numpy as np
import pytest

from kernels.arrays import Array
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.normal_equations import BlockNormalEquations
from reconcile.selection.cross_validation import CrossValidation

RECORDINGS, BLOCKS, SAMPLES = 2, 36, 40


def equations() -> tuple[BlockNormalEquations, list[Array]]:
    """y = 2 base + column + noise, a second column that tells nothing and one free in each recording."""
    rng = np.random.default_rng(4)
    terms = [
        CandidateTerm("cogging", (1.0,), False, (1,)),
        CandidateTerm("stribeck_friction", (1.0,), False, (2,)),
        CandidateTerm("torque_ripple", (1.0,), True, (3,)),
    ]
    of, raw = BlockNormalEquations([False], terms, np.repeat(np.arange(RECORDINGS), BLOCKS)), []
    for number in range(RECORDINGS):
        x = rng.normal(size=(4, BLOCKS * SAMPLES))
        y = 2.0 * x[0] + x[1] + (0.5 - number) * x[3] + 0.3 * rng.normal(size=BLOCKS * SAMPLES)
        raw.append(np.concatenate((y[None], x)))
        block = number * BLOCKS + np.arange(BLOCKS * SAMPLES) // SAMPLES
        of.add(raw[-1].copy(), block, np.zeros(len(y)))
    of.normalise()
    return of, raw


@pytest.mark.parametrize("chosen", [(), (0,), (1,), (0, 2), (2, 1)])
def test_the_sum_of_cross_validated_squares_is_that_of_all_short_blocks(chosen: tuple[int, ...]) -> None:
    of, _ = equations()
    validation = CrossValidation(of, np.flatnonzero(np.arange(RECORDINGS * BLOCKS) % 4 < 3))
    terms = [of.candidates[place] for place in chosen]
    before = validation.cross_validated_squares([])
    assert validation.total_squares(terms) == pytest.approx(
        float(validation.cross_validated_squares(terms).sum()), rel=1e-9
    )
    if terms:
        assert validation.gain(terms, before) == pytest.approx(
            validation.score_last(terms, before, len(terms)).gain, abs=1e-9
        )


def test_a_draw_of_blocks_is_fitted_as_its_samples_are() -> None:
    of, raw = equations()
    chosen, rng = [of.candidates[2], of.candidates[0]], np.random.default_rng(0)
    slots = of.slots(chosen)
    drawn = [rng.choice(RECORDINGS * BLOCKS, RECORDINGS * BLOCKS) for _ in range(3)]
    found = of.denormalised(slots, of.solve_each(slots, drawn))
    for blocks, theta in zip(drawn, found, strict=True):
        x, y = [], []
        for block in blocks:
            recording, first = divmod(int(block), BLOCKS)
            part = raw[recording][:, first * SAMPLES : (first + 1) * SAMPLES]
            own = [part[4] * (recording == other) for other in range(RECORDINGS)]
            x.append(np.stack([part[1], *own, part[2]]))
            y.append(part[0])
        expected, *_ = np.linalg.lstsq(np.concatenate(x, axis=1).T, np.concatenate(y), rcond=None)
        np.testing.assert_allclose(theta, expected, rtol=1e-6, atol=1e-8)
