"""Left out in turn: what repeats in every recording is kept, what follows one recording is withdrawn."""

import numpy as np
import pytest

from kernels.arrays import Array, Index
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.normal_equations import BlockNormalEquations
from reconcile.selection.predictive_terms import held_out_parts, held_out_squares_by_block, predictive_terms

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


def left_out_squares(of: BlockNormalEquations, terms: list[CandidateTerm], parts: list[Index]) -> Array:
    """Of each part, predicted from the others."""
    squares, ends = held_out_squares_by_block(of, terms, parts), np.cumsum([len(part) for part in parts])
    return np.array([part.sum() for part in np.split(squares, ends[:-1])])


def test_left_out_squares_are_those_of_least_squares_on_the_others() -> None:
    of, base, column = equations((1.0, 0.5, 1.5))
    parts = held_out_parts(of, np.arange(RECORDINGS * BLOCKS))
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


def test_a_recording_of_one_block_is_predicted_without_what_it_has_of_its_own() -> None:
    """There is no other stretch of it that could tell; the other recordings keep theirs."""
    of, *_ = equations((1.0, -1.0, 0.7), own=True)
    blocks = np.arange(2 * BLOCKS + 1)
    parts = held_out_parts(of, blocks)
    assert [len(part) for part in parts] == [BLOCKS, BLOCKS, 1]
    with_it, without = (left_out_squares(of, terms, parts) for terms in (of.candidates, []))
    assert with_it[2] == pytest.approx(without[2], rel=1e-3)
    assert all(with_it[:2] < 0.1 * without[:2])
    assert predictive_terms(of, of.candidates, blocks) == (of.candidates, [])


def test_an_only_recording_is_cut_into_thirds() -> None:
    of, *_ = equations((1.0,))
    assert [len(part) for part in held_out_parts(of, np.arange(BLOCKS))] == [6, 5, 5]
    terms, _ = predictive_terms(of, of.candidates, np.arange(BLOCKS))
    assert terms == of.candidates


def warmed(slopes: tuple[float, float], *, trend: float) -> BlockNormalEquations:
    """y = base + slope * temperature * base + noise, with a `trend`; cool: 0 to 1 K, warm: 20 to 25 K."""
    rng = np.random.default_rng(11)
    of = BlockNormalEquations(
        [False],
        [CandidateTerm("temperature_dependent_friction", (0.0,), False, (1,))],
        np.repeat([0, 1], BLOCKS),
    )
    n = BLOCKS * SAMPLES
    for number, (slope, low_k, high_k) in enumerate(((slopes[0], 0.0, 1.0), (slopes[1], 20.0, 25.0))):
        base = np.sign(np.sin(np.arange(n) / 7.0))
        column = base * np.linspace(low_k, high_k, n)
        y = base + slope * column + trend * base * np.linspace(0.0, 1.0, n) ** 2 + 0.1 * rng.normal(size=n)
        of.add(np.stack((y, base, column)), number * BLOCKS + np.arange(n) // SAMPLES, np.zeros(n))
    of.normalise()
    return of


def test_a_cool_recording_is_not_asked_to_foretell_a_warm_one() -> None:
    """Its degree says nothing of twenty more; thirds of both together tell."""
    of = warmed((-0.02, -0.02), trend=0.05)
    parts = held_out_parts(of, np.arange(2 * BLOCKS))
    squares = [left_out_squares(of, terms, parts).sum() for terms in (of.candidates, [])]
    assert squares[0] > squares[1]  # asked all the same, the term would have to go
    kept, withdrawn = predictive_terms(of, of.candidates, np.arange(2 * BLOCKS))
    assert (kept, withdrawn) == (of.candidates, [])


def test_what_the_others_have_seen_of_an_effect_judges_it() -> None:
    """Recordings at the same temperatures, with friction that rises in one and falls in the other."""
    of, *_ = equations((1.0, -1.0, 0.2))
    assert predictive_terms(of, of.candidates, np.arange(RECORDINGS * BLOCKS))[0] == []
    alike = warmed((0.0, 0.0), trend=0.0)
    assert predictive_terms(alike, alike.candidates, np.arange(2 * BLOCKS))[0] == []
