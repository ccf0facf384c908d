"""Rivals of the families: attribution adds up, rollouts find a mass, PySINDy is judged as we are."""

import math
from typing import Any

import numpy as np
import pytest
from formula_residuals import COULOMB_N, MASS_KG, data

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.examples.real.judged import Judged
from reconcile.regression.regression_data import low_pass_of, samples_in_use, target_and_baseline
from tests.campaigns.bench.boosting_rival import shapley
from tests.campaigns.bench.rollout_rival import fitted_rollouts
from tests.campaigns.pages.rivals import COMPLEXITIES, SindyRules, section, sindy_score, tuned


def test_shares_of_coordinates_add_up_and_a_coordinate_without_use_has_none() -> None:
    x = np.random.default_rng(1).normal(size=(4000, 3))
    y = 2.0 * x[:, 0] + x[:, 1]
    shares = shapley(lambda z: 2.0 * z[:, 0] + z[:, 1], x, y)
    assert shares["acceleration"] == pytest.approx(0.0, abs=1e-12)
    # nothing known predicts with another sample's values: twice the variance, so -1 is where it begins
    assert sum(shares.values()) == pytest.approx(2.0, abs=0.1)
    assert shares["position"] == pytest.approx(4.0 * shares["velocity"], rel=0.1)


def test_rollouts_find_mass_and_friction_of_an_axis_by_formula() -> None:
    one = data()
    force_n, rigid = target_and_baseline(one, ResidualChannel.FORCE)
    used = samples_in_use(one, ResidualChannel.FORCE)
    place = low_pass_of(one)(one.motion.position_m)
    judged = Judged(None, one, force_n, rigid, place, used)  # type: ignore[arg-type]
    found = fitted_rollouts([judged])
    assert found["inertia"] == pytest.approx(MASS_KG, rel=0.03)
    assert found["coulomb"] == pytest.approx(COULOMB_N, rel=0.1)


def case(seed: int, effect: str, share: float, *, quiet: bool) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a row and PySINDy's answer: it names `effect` with a share of the variance."""
    concealed = {"name": "backlash", "parameters": {}, "also": [], "alike": [], "observable": True}
    truth: dict[str, Any] = {"family": "f", "seed": seed, "kind": "quiet" if quiet else "single"}
    truth |= {"clutter": [], "foreign": None, "effects": [] if quiet else [concealed]}
    named = [[effect, share, []]]
    answer = {"complexities": [*COMPLEXITIES], "named": named, "held_out": {"force": [2.0, 1.0]}}
    return {"family": "f", "seed": seed, "truth": truth}, {"pysindy": [answer]}


def test_pysindy_is_tuned_by_our_worth_and_scored_by_our_rule() -> None:
    cases = [case(seed, "backlash", 0.5, quiet=False) for seed in range(3)]
    cases += [case(seed, "cogging", 0.15, quiet=True) for seed in range(3, 6)]
    rows, answers = [row for row, _ in cases], {("f", row["seed"]): answer for row, answer in cases}
    rules = tuned(rows, answers)
    assert rules == SindyRules(least_share=0.2)
    scores = [sindy_score(row, answers["f", row["seed"]], rules) for row in rows]
    assert [score["right"] for score in scores[:3]] == [{"backlash": True}] * 3
    assert not any(score["false"] for score in scores)
    assert sindy_score(rows[0], answers["f", 0], SindyRules(left_share=0.2))["unknown"]
    assert not sindy_score(rows[0], answers["f", 0], SindyRules(left_share=math.inf))["unknown"]
    assert list(section(rows, rows, scores, [])) == []
