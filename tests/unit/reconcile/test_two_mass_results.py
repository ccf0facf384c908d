"""The two-mass model's values go into the file; masses and friction only where they serve the force too."""

from typing import Any

import numpy as np
import pytest
from known_axis import AXIS, explanation_of, motion_m

from reconcile.identification.two_mass import MOTOR, TABLE, VISCOUS, TwoMassModel
from reconcile.identification.two_mass_fit import COULOMB, DAMPING, STIFFNESS, TwoMassFit
from reconcile.model_update import two_mass_results
from reconcile.model_update.two_mass_results import two_mass_results as results_of

VALUES = {STIFFNESS: 1e8, DAMPING: 2e3, TABLE: 40.0, MOTOR: 10.0, COULOMB: 11.0, VISCOUS: 90.0}
FIT = TwoMassFit(VALUES, {}, 0.0, np.ones(4), np.ones(4), at_bound=False)


@pytest.mark.parametrize(("left_of_rigid", "are_written"), [(0.5, True), (3.0, False)])
def test_masses_and_friction_that_leave_more_of_the_force_are_not_written(
    monkeypatch: pytest.MonkeyPatch, left_of_rigid: float, are_written: bool
) -> None:
    """A presliding that the plant lacks draws its friction: once 64 N s/m were written of 146."""
    explanation: Any = explanation_of([motion_m("sine")], [])
    [residual] = explanation.residuals
    held_out = np.arange(len(residual.used)) % 2 == 0
    explanation = explanation._replace(residuals=[residual._replace(held_out=held_out)])
    left_n = left_of_rigid * explanation.refitted.train
    monkeypatch.setattr(
        two_mass_results, "_force_residual_n", lambda _model, one: np.full(len(one.after), left_n)
    )
    not_simulated: Any = None
    sections, _ = results_of(TwoMassModel(FIT, not_simulated, axis=0), [explanation], AXIS.lead_m)
    assert sections["drive_compliance"] == {"stiffness_n_um": pytest.approx(100.0), "damping_n_s_m": 2e3}
    assert (sections.keys() >= {"table", "motor", "coulomb_friction", "viscous_friction"}) is are_written
