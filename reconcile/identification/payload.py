"""Payload: the identified mass exceeds the nominal one while friction is unchanged.

A wrong force constant or wrong data sheet values would change friction too; the verdict then is `parameters`.
An unexplained force biases the mass if it is correlated with the acceleration by chance. An added mass is
therefore reported only if its own force is larger.
"""

from collections.abc import Mapping

import numpy as np
from scipy.special import ndtr

from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters
from reconcile.identification.confidence import confidence
from reconcile.identification.findings import IdentifiedEffect
from reconcile.identification.parameter_estimates import Estimate
from reconcile.regression.regression_problem import RegressionProblem

LEAST_EXCESS = 0.04
"""Least excess over the nominal mass, as a share of it."""
LEAST_GAIN = 0.1
"""Least share of the variance that refitting explains, so that the motion shows the mass."""
FRICTION_CHANGE_RATIO = 0.4
"""Largest relative change of friction over that of the mass."""


def mass_bias_kg(problem: RegressionProblem, unexplained_n: float) -> float:
    """Return the mass whose force has the RMS of the unexplained one in the used samples."""
    used = zip(problem.datasets, problem.used, strict=True)
    acceleration_m_s2 = np.concatenate([data.motion.acceleration_m_s2[samples] for data, samples in used])
    return unexplained_n / max(float(np.sqrt(np.mean(acceleration_m_s2**2))), 1e-300)


def payload(
    values: Mapping[str, Estimate], axis: NominalAxis, gain: float, heldout_gain: float, *, bias_kg: float
) -> IdentifiedEffect | None:
    """Return the payload if the identified baseline `values` show one; `gain`: share explained by refitting.

    `bias_kg`: the mass whose force is as large as the unexplained one.
    """
    nominal = baseline_parameters(axis)
    mass, nominal_kg = values["mass_kg"], nominal["mass_kg"]
    excess = mass.value / nominal_kg - 1.0
    least_kg = nominal_kg * (1.0 + 0.5 * LEAST_EXCESS)
    if gain < LEAST_GAIN or excess < LEAST_EXCESS or mass.low < least_kg:
        return None
    if mass.value - nominal_kg < bias_kg:
        return None
    for key in ("viscous_n_s_m", "coulomb_n"):
        friction, fitted = nominal[key], values[key]
        allowed = FRICTION_CHANGE_RATIO * excess * max(friction, 1e-9)
        if not fitted.low <= friction <= fitted.high and abs(fitted.value - friction) > allowed:
            return None
    added = Estimate(mass.value - nominal_kg, mass.low - nominal_kg, mass.high - nominal_kg, "kg")
    spread_kg = max((mass.high - mass.low) / 3.92, 1e-9)
    return IdentifiedEffect(
        effect="payload_mass",
        channel="force",
        confidence=confidence(float(ndtr((least_kg - mass.value) / spread_kg)), heldout_gain),
        equivalent=[],
        rivals=[],
        candidates=[],
        parameters={"mass_kg": added},
        gain=gain,
        heldout_gain=heldout_gain,
        explanation=(
            f"the axis moves {added.value:.2f} kg more than the model says, and friction is as it was: "
            "a payload; a wrong force constant would have changed friction alike"
        ),
        share=heldout_gain,
    )
