"""When a term is accepted: worth it, beyond chance, possible, and no shadow of presliding."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from formula_residuals import problem

from reconcile.catalogue.kinds import RegressionData
from reconcile.regression.regression_problem import SINCE_REVERSAL
from reconcile.selection import acceptance
from reconcile.selection.acceptance import SelectionContext
from reconcile.selection.cross_validation import CrossValidation
from reconcile.selection.selection_rules import SelectionRules

Effect = Callable[[RegressionData], np.ndarray]

COGGING, STRIBECK = ("cogging", (4.0,)), ("stribeck_friction", (3.5e-3,))
SPLINES = (SINCE_REVERSAL, (1e-7, 1e-2, 9.0))


def cogging(data: RegressionData) -> np.ndarray:
    return 3.0 * np.sin(4.0 * 2.0 * math.pi * data.motion.position_m / data.lead_m)


def stribeck(data: RegressionData, height_n: float = 5.0) -> np.ndarray:
    return height_n * data.motion.direction * np.exp(-((data.motion.velocity_m_s / 3.5e-3) ** 2))


def presliding(data: RegressionData) -> np.ndarray:
    """Friction that is higher over the first millimetre behind a reversal."""
    m = data.motion
    return 6.0 * m.last_direction * np.exp(-m.distance_since_reversal_m / 1e-3)


def is_accepted(
    effect: Effect,
    term: tuple[str, tuple[float, ...]],
    rules: SelectionRules | None = None,
    *,
    shadowed: bool = True,
) -> bool:
    """Whether a term is, in a recording that holds the effect, with presliding's splines beside it."""
    found = problem(effect, [term, SPLINES])
    validation = CrossValidation(found.equations, np.flatnonzero(found.equations.samples))
    [candidate] = [c for c in found.equations.candidates if c.effect == term[0]]
    [shadow] = [c for c in found.equations.candidates if c.effect == SINCE_REVERSAL]
    before = validation.cross_validated_squares([])
    context = SelectionContext(
        validation, rules or SelectionRules(), [candidate], float(before.sum()), [shadow] * shadowed
    )
    return acceptance.is_accepted(context, [], validation.score([], before, candidate), before)


def nothing(data: RegressionData) -> np.ndarray:
    return np.zeros(len(data.time_s))


def test_present_effects_are_accepted_and_absent_ones_are_not() -> None:
    assert is_accepted(cogging, COGGING)
    assert not is_accepted(nothing, COGGING)


def test_an_effect_below_the_least_share_is_not_accepted() -> None:
    assert not is_accepted(cogging, COGGING, SelectionRules(least_initial_share=0.999))
    assert not is_accepted(cogging, COGGING, SelectionRules(least_gain=0.999))


def test_an_effect_with_an_unphysical_sign_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("reconcile.selection.acceptance.possible", lambda _effect, _coefficients: False)
    assert not is_accepted(cogging, COGGING)


def test_stribeck_friction_shows_at_speed_and_presliding_cannot_pass_for_it() -> None:
    assert is_accepted(stribeck, STRIBECK)
    assert is_accepted(presliding, STRIBECK, shadowed=False)
    assert not is_accepted(presliding, STRIBECK)
