"""A mass that is off while friction is not: something was put onto the table.

A wrong force constant or wrong data sheet values would change the others too: that is `parameters`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scipy.special import ndtr

from reconcile.confidence import confidence
from reconcile.findings import Estimate, Finding
from reconcile.model_effects_held import held_base

if TYPE_CHECKING:
    from collections.abc import Mapping

    from reconcile.model_file import NominalAxis

LEAST_SHARE = 0.04
"""Of the nominal mass."""
LEAST_GAIN = 0.1
"""Share of the variance that other values take away: the mass must matter."""
STILL = 0.4
"""Friction may be off by so much of what the mass is off, relatively."""


def payload(
    values: Mapping[str, Estimate], axis: NominalAxis, gain: float, heldout_gain: float
) -> Finding | None:
    """The finding, if the fitted `values` of the model say so; `gain`: what fitting them anew is worth."""
    given_anew = held_base(axis.held, axis)
    mass, nominal_kg = values["mass_kg"], given_anew["mass_kg"]
    off = mass.value / nominal_kg - 1.0
    if gain < LEAST_GAIN or off < LEAST_SHARE or mass.low < nominal_kg * (1.0 + 0.5 * LEAST_SHARE):
        return None
    for key in ("viscous_n_s_m", "coulomb_n"):
        given = given_anew[key]
        within = values[key].low <= given <= values[key].high
        if not within and abs(values[key].value - given) > STILL * off * max(given, 1e-9):
            return None
    added = Estimate(mass.value - nominal_kg, mass.low - nominal_kg, mass.high - nominal_kg, "kg")
    spread_kg = max((mass.high - mass.low) / 3.92, 1e-9)
    return Finding(
        "payload_mass",
        "force",
        confidence(
            float(ndtr((nominal_kg * (1.0 + 0.5 * LEAST_SHARE) - mass.value) / spread_kg)), heldout_gain
        ),
        [],
        [],
        [],
        {"mass_kg": added},
        gain,
        heldout_gain,
        f"the axis moves {added.value:.2f} kg more than the model says, and friction is as it was: "
        "a payload; a wrong force constant would have changed friction alike",
        heldout_gain,
    )
