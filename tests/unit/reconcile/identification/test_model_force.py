"""The force of a fitted model: Newton's law in motion, static friction at standstill."""

import numpy as np
import pytest
from formula_residuals import COULOMB_N, MASS_KG, data

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.model_force import with_identified_force
from reconcile.regression.regression_problem import regression_problem

VISCOUS_N_S_M = 40.0
HOLDING_N = 5.0


@pytest.fixture(scope="module")
def seen() -> tuple:
    """A recording, and the same seen through mass, viscous and Coulomb friction."""
    given = data()
    m = given.motion
    force_n = np.where(m.standing_still, HOLDING_N, given.force_n + VISCOUS_N_S_M * m.velocity_m_s)
    found = regression_problem([given._replace(force_n=force_n)], ResidualChannel.FORCE, only=True)
    slots = found.equations.slots([])
    return given, with_identified_force(found, 0, slots, np.array([MASS_KG, VISCOUS_N_S_M, COULOMB_N]))


def test_in_motion_the_model_force_follows_newtons_law(seen: tuple) -> None:
    given, through = seen
    m = given.motion
    newton_n = MASS_KG * m.acceleration_m_s2 + VISCOUS_N_S_M * m.velocity_m_s + COULOMB_N * m.direction
    moving = m.moving
    assert through.model_force_n[moving] == pytest.approx(newton_n[moving], abs=1e-9)
    assert np.array_equal(through.motion.direction[moving], m.direction[moving])


def test_at_standstill_friction_balances_the_measured_force(seen: tuple) -> None:
    given, through = seen
    resting = np.flatnonzero(given.motion.standing_still)
    inside = resting[(resting > 3000) & np.isin(resting + 100, resting) & np.isin(resting - 100, resting)]
    assert len(inside) > 200
    assert through.motion.direction[inside] == pytest.approx(HOLDING_N / COULOMB_N, abs=0.01)
    assert through.model_force_n[inside] == pytest.approx(HOLDING_N, abs=0.1)
    assert np.abs(through.motion.direction).max() <= 1.0
