"""Left out in turn: what repeats in every recording is kept, what follows one recording is withdrawn."""

import numpy as np
import pytest

from kernels.arrays import Array
from reconcile.regression.normal_equations import BlockNormalEquations, CandidateTerm
from reconcile.selection.left_out import left_out_parts, left_out_squares, predictive_terms

RECORDINGS, BLOCKS, SAMPLES = 3, 16, 40


def equations(signs: tuple[float, ...], *, own: bool = False) -> tuple[BlockNormalEquations, Array, Array]:
    """y = 2 base + sign(recording) * column + noise; also base and column as drawn, (recordings, n)."""
    rng = np.random.default_rng(3)
    term = CandidateTerm("cogging", (1.0,), own, (1,))
    of = BlockNormalEquations([False], [term], np.repeat(np.arange(len(signs)), BLOCKS))
    base, column = rng.normal(size=(2, len(signs), BLOCKS * SAMPLES))
    for number, sign in enumerate(signs):
        y = 2.0 * base[number] + sign * column[number] + 0.1 * rng.normal(size=BLOCKS * SAMPLES)
        block = number * BLOCKS + np.arange(BLOCKS * SAMPLES) // SAMPLES
        of.add(np.stack((y, base[number], column[number])), block, np.zeros(len(y)))
    of.normalise()
    return of, base, column


def test_left_out_squares_are_those_of_least_squares_on_the_others() -> None:
    of, base, column = equations((1.0, 0.5, 1.5))
    parts = left_out_parts(of, np.arange(RECORDINGS * BLOCKS))
    found = left_out_squares(of, of.candidates, parts)
    rows = [np.stack((base[k], column[k]), axis=1) for k in range(RECORDINGS)]
    targets = [of.rows[k][0] * of.unit[0] for k in range(RECORDINGS)]
    for k in range(RECORDINGS):
        others = [j for j in range(RECORDINGS) if j != k]
        theta, *_ = np.linalg.lstsq(
            np.concatenate([rows[j] for j in others]),
            np.concatenate([targets[j] for j in others]),
            rcond=None,
        )
        assert found[k] == pytest.approx(float(((targets[k] - rows[k] @ theta) ** 2).sum()), rel=1e-6)


@pytest.mark.parametrize(("signs", "kept"), [((1.0, 1.0, 1.0), True), ((1.0, -1.0, 0.2), False)])
def test_an_effect_is_kept_if_the_others_predict_it(signs: tuple[float, ...], *, kept: bool) -> None:
    of, *_ = equations(signs)
    terms, withdrawn = predictive_terms(of, of.candidates, np.arange(RECORDINGS * BLOCKS))
    assert bool(terms) is kept
    assert [one.effect for one in withdrawn] == ([] if kept else ["cogging"])
    assert all("3 recordings left out in turn" in one.why for one in withdrawn)


def test_what_each_recording_has_of_its_own_is_judged_within_it() -> None:
    of, *_ = equations((1.0, -1.0, 0.7), own=True)
    terms, withdrawn = predictive_terms(of, of.candidates, np.arange(RECORDINGS * BLOCKS))
    assert (terms, withdrawn) == (of.candidates, [])


def test_an_only_recording_is_cut_into_thirds() -> None:
    of, *_ = equations((1.0,))
    assert [len(part) for part in left_out_parts(of, np.arange(BLOCKS))] == [6, 5, 5]
    terms, _ = predictive_terms(of, of.candidates, np.arange(BLOCKS))
    assert terms == of.candidates
