"""A plant's disturbance of a given spectrum, as lines of known phase; and the lines of a density."""

import math

import numpy as np

from hil_sim.physics.load import disturbance_spectrum as physics
from kernels.arrays import Array
from reconcile.catalogue import periodic_disturbance
from reconcile.catalogue.conversion import ModelEffect, ModelTerm, PlantValues
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.periodic import sine_and_cosine


def lines_of(frequency_hz: Array, density: Array, seed: int = 0) -> PlantValues:
    """The plant's parameters for a one-sided density (n,), N^2/Hz: each line has an equal share of the power.

    The lines lie where the halves of the shares are, so that they are close where the power is.
    """
    power = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(frequency_hz))))
    if power[-1] <= 0.0:
        return {"frequency_hz": [], "amplitude_n": [], "seed": float(seed)}
    halves = (np.arange(physics.LINES) + 0.5) / physics.LINES * power[-1]
    amplitude_n = math.sqrt(2.0 * float(power[-1]) / physics.LINES)
    return {
        "frequency_hz": np.interp(halves, power, frequency_hz).tolist(),
        "amplitude_n": [amplitude_n] * physics.LINES,
        "seed": float(seed),
    }


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    found = []
    for line, (frequency_hz, amplitude_n) in enumerate(
        zip(of.params.frequency_hz, of.params.amplitude_n, strict=True)
    ):
        if amplitude_n == 0.0:
            break
        coefficients = sine_and_cosine(-amplitude_n, physics.phase_rad(of.params.seed, line))
        found.append(ModelTerm(periodic_disturbance.ENTRY.name, (frequency_hz,), coefficients))
    return found


ENTRY = CatalogueEntry(physics=physics, from_plant=_from_plant)
