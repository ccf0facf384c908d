"""Pairs of sine and cosine columns, which the periodic effects share."""

import cmath
import math
from collections.abc import Sequence

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, ModelTerm, PlantValues
from reconcile.catalogue.kinds import Parameter, ResidualChannel

RIPPLES_A_TURN = 4.0
"""Harmonic of an unseen ripple of cogging or torque."""


def pair(angle_rad: Array) -> Array:
    """Columns sin and cos, (n, 2)."""
    return np.stack((np.sin(angle_rad), np.cos(angle_rad)), axis=1)


def amplitude_and_phase(coefficients: Array, unit: str) -> dict[str, Parameter]:
    """A sin + B cos as amplitude and phase of amplitude * sin(angle + phase)."""
    a, b = float(coefficients[0]), float(coefficients[1])
    return {
        "amplitude": Parameter(math.hypot(a, b), unit),
        "phase_rad": Parameter(math.atan2(b, a), "rad"),
    }


def sine_and_cosine(amplitude: float, phase_rad: float) -> tuple[float, float]:
    """Coefficients of `pair` for amplitude * sin(angle + phase)."""
    return amplitude * math.cos(phase_rad), amplitude * math.sin(phase_rad)


def force_harmonics(
    effect: str, harmonics: Sequence[float], amplitudes: Sequence[float], phases_rad: Sequence[float]
) -> list[ModelTerm]:
    """Terms of a force on the table, up to the first amplitude of zero, where the plant's list ends."""
    found = []
    for harmonic, amplitude, phase_rad in zip(harmonics, amplitudes, phases_rad, strict=True):
        if amplitude == 0.0:
            break
        # the motor needs the opposite of a force on the table
        found.append(
            ModelTerm(effect, (harmonic,), sine_and_cosine(-amplitude, phase_rad), ResidualChannel.FORCE)
        )
    return found


def waves(
    found: IdentifiedTerms, notes: list[str], *, pitch: str, amplitude: str, most: int = 1
) -> PlantValues:
    """The plant's waves: those of one pitch are added, and the `most` strongest kept, which the plant takes.

    `pitch` and `amplitude` are names of parameters of the plant's effect; an effect of fixed pitch has none.
    """
    sums: dict[float, complex] = {}
    for term in found.terms:
        own = term.get(pitch, 1.0)
        sums[own] = sums.get(own, 0.0) + cmath.rect(term["amplitude"], term["phase_rad"])
    strongest = sorted(sums, key=lambda own: abs(sums[own]), reverse=True)
    kept, left = strongest[:most], strongest[most:]
    notes += [
        f"{found.effect}: {pitch} {own:g} (amplitude {abs(sums[own]):.3g}) is left out, the plant "
        f"takes {most}"
        for own in left
    ]
    values = {
        pitch: kept,
        amplitude: [abs(sums[own]) for own in kept],
        "phase_rad": [cmath.phase(sums[own]) for own in kept],
    }
    return values if most > 1 else {key: value[0] for key, value in values.items()}
