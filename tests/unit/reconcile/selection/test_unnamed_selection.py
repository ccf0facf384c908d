"""Unnamed terms are selected for a real residual, over the coordinate that it depends on."""

import math
from collections.abc import Callable

import numpy as np
from formula_residuals import problem

from reconcile.catalogue.kinds import RegressionData
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.selection.cross_validation import SelectionRules
from reconcile.selection.unnamed_selection import select_unnamed


def bump(data: RegressionData) -> np.ndarray:
    """A force at one place of the travel, whatever the speed: no entry of the catalogue is like it."""
    return 8.0 * np.exp(-(((data.motion.position_m - 0.01) / 0.008) ** 2))


def cogging(data: RegressionData) -> np.ndarray:
    return 3.0 * np.sin(4.0 * 2.0 * math.pi * data.motion.position_m / data.lead_m)


def terms_of(effect: Callable[[RegressionData], np.ndarray], *, named: bool = False) -> list[str]:
    found = problem(effect, [("cogging", (4.0,))])
    chosen = found.equations.candidates if named else []
    blocks = np.flatnonzero(found.equations.samples)
    return [name for name, _ in select_unnamed(found, chosen, blocks, SelectionRules())]


def test_a_position_dependent_force_is_reported_by_its_coordinate() -> None:
    assert terms_of(bump)[0] == PREFIX + "position"


def test_noise_and_named_effects_need_no_unnamed_term() -> None:
    assert terms_of(cogging, named=True) == []
