"""Shared by the periodic effects: sine and cosine columns, and their amplitude and phase in a plant."""

import cmath
import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm, PlantValues
from reconcile.catalogue.kinds import RegressionData, ResidualChannel, ShapeParameters, SiParameter

RIPPLES_A_TURN = 4.0
"""Harmonic of a plausible ripple of cogging or torque."""
FEWEST_PERIODS = 2.0
"""Least periods within the range of positions: a single one may be any force over the travel."""
WHOLE_TURN = 0.99
"""Least turns within it: a measured turn ends one point before its start."""
OF_THE_JOINT = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 18, 24)
"""Harmonics of a turn of the joint, by the gear's last wheel, its ring, its bearing."""


def pair(angle_rad: Array) -> Array:
    """Columns sin and cos, (n, 2)."""
    return np.stack((np.sin(angle_rad), np.cos(angle_rad)), axis=1)


def over_turns(data: RegressionData, shape: ShapeParameters) -> Array:
    """Columns (n, 2) of a harmonic, which repeats `shape[0]` times a turn of the screw."""
    return pair(shape[0] * 2.0 * np.pi / data.lead_m * data.motion.position_m)


def harmonics_of_the_joint(datasets: Sequence[RegressionData]) -> list[float]:
    """Harmonics (1/turn of the motor) of a turn of the joint; none on a linear axis or without a gear."""
    data = datasets[0]
    turn = data.lead_m / (2.0 * math.pi)
    return [k * turn for k in OF_THE_JOINT] if data.rotary and turn < 1.0 else []


def covers_turns(datasets: Sequence[RegressionData], harmonic: float) -> bool:
    """Whether any recording covers a whole turn (of the motor) and two periods of a harmonic of it."""
    range_m = max(float(np.ptp(data.motion.position_m)) for data in datasets)
    turns = range_m / datasets[0].lead_m
    return turns >= WHOLE_TURN and harmonic * turns >= WHOLE_TURN * FEWEST_PERIODS


def covered(datasets: Sequence[RegressionData], harmonics: Iterable[float]) -> list[ShapeParameters]:
    """Return the shapes of those harmonics (1/turn of the motor) that the recordings cover."""
    return [(float(k),) for k in harmonics if covers_turns(datasets, k)]


def sine_and_cosine(amplitude: float, phase_rad: float) -> tuple[float, float]:
    """Coefficients of `pair` for amplitude * sin(angle + phase)."""
    return amplitude * math.cos(phase_rad), amplitude * math.sin(phase_rad)


def amplitude_and_phase_rad(sine: float, cosine: float) -> tuple[float, float]:
    """Amplitude and phase of the wave with these coefficients of `pair`, the inverse of `sine_and_cosine`."""
    return math.hypot(sine, cosine), math.atan2(cosine, sine)


class Wave(NamedTuple):
    """Converts between the waves of a plant's effect and the coefficients of `pair`."""

    pitch: str
    """Name of the parameter; empty if it is fixed."""
    pitch_unit: str
    amplitude: str
    """Name of the plant's parameter."""
    unit: str
    """Of the amplitude, SI."""
    channel: ResidualChannel = ResidualChannel.FORCE
    sign: float = -1.0
    """-1 of a force on the table: the motor needs the opposite."""
    most: int = 1
    """Most waves in a plant; if more than one, its parameters are lists that an amplitude of 0 ends."""

    def parameters(self, shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
        """Pitch, amplitude, and the phase in the first recording."""
        amplitude, phase_rad = amplitude_and_phase_rad(*(self.sign * coefficients[:2]).tolist())
        return {
            self.pitch: SiParameter(shape[0], self.pitch_unit),
            "amplitude": SiParameter(amplitude, self.unit),
            "phase_rad": SiParameter(phase_rad, "rad"),
        }

    def to_plant(self, found: IdentifiedTerms, notes: list[str]) -> PlantValues:
        """Return the plant's waves: those of one pitch are added, and the strongest kept."""
        sums: dict[float, complex] = {}
        for term in found.terms:
            own = term.get(self.pitch, 1.0)
            sums[own] = sums.get(own, 0.0) + cmath.rect(term["amplitude"], term["phase_rad"])
        strongest = sorted(sums, key=lambda own: abs(sums[own]), reverse=True)
        kept, left = strongest[: self.most], strongest[self.most :]
        notes += [
            f"{found.effect}: {self.pitch} {own:g} (amplitude {abs(sums[own]):.3g}) is left out, the plant "
            f"takes {self.most}"
            for own in left
        ]
        values = {
            self.pitch: kept,
            self.amplitude: [abs(sums[own]) for own in kept],
            "phase_rad": [cmath.phase(sums[own]) for own in kept],
        }
        return values if self.most > 1 else {key: value[0] for key, value in values.items()}

    def from_plant(self, of: ModelEffect) -> list[ModelTerm]:
        """Return the plant's waves as terms, up to the first amplitude of zero."""
        lists = [getattr(of.params, name) for name in (self.pitch, self.amplitude, "phase_rad")]
        if self.most == 1:
            lists = [[value] for value in lists]
        terms = []
        for pitch, amplitude, phase_rad in zip(*lists, strict=True):
            if amplitude == 0.0:
                break
            coefficients = sine_and_cosine(self.sign * amplitude, phase_rad)
            terms.append(ModelTerm(of.effect, (pitch,), coefficients, self.channel))
        return terms
