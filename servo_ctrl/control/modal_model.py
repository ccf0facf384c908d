"""A modal model of an axis: rigid mass with viscous friction, structural modes, and delay.

    P(s) = [ r / (s^2 + b s) + sum over k of c_k / (s^2 + 2 z_k w_k s + w_k^2) ] exp(-s tau)

The model gives the response that a controller in discrete time sees: the set point takes effect one period
after its tick and is held (zero-order hold), the position is sampled. Motor and scale share poles and delay;
each output has its own residues r and c_k (Ewins, Modal Testing, chapter 4).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.control.axis_loop import Plant, Response

ALIASES = 4
"""Terms on either side in the sum by which sampling folds the spectrum. Chosen, as are the numbers below."""
LEAST_PROMINENCE = 0.25
"""Peak of a mode, as a share of the rigid response at its frequency, from which it is called a resonance."""
RESONANT_DAMPING = 0.5
"""Damping ratio below which a mode has a peak that can be called a resonance."""
LOWEST_HZ, POINTS = 0.02, 900
"""Lowest frequency of the grid, far below any crossover, and its points at equal ratios."""
MODE_POINTS = np.sinh(np.linspace(-4.0, 4.0, 61)) / 4.0
"""Further points around each mode, in half widths of its peak."""


class StructuralMode(NamedTuple):
    """A pole pair, with its residues c_k in motor and scale position per force."""

    frequency_hz: float
    damping_ratio: float
    motor_1_kg: float
    scale_1_kg: float


class ModalModel(NamedTuple):
    """Parameters of the model. `motor_1_kg`, `scale_1_kg`: r, one over the moved mass, by either output."""

    period_s: float
    motor_1_kg: float
    scale_1_kg: float
    friction_1_s: float
    """b: viscous friction over mass."""
    delay_s: float
    """tau, in addition to the one period until a set point takes effect."""
    modes: tuple[StructuralMode, ...]
    error: float
    """Root mean square of the relative error over all lines of the fit."""

    @property
    def mass_kg(self) -> float:
        """The moved mass, as the motor shows it."""
        return 1.0 / self.motor_1_kg

    def motor(self, frequency_hz: Array, shift: float = 1.0) -> Response:
        """Response of the motor position, m/N, (n,). `shift`: factor on the frequencies of all modes."""
        return self._output(frequency_hz, shift, self.motor_1_kg, [m.motor_1_kg for m in self.modes])

    def scale(self, frequency_hz: Array, shift: float = 1.0) -> Response:
        """Response of the scale position, likewise."""
        return self._output(frequency_hz, shift, self.scale_1_kg, [m.scale_1_kg for m in self.modes])

    def plant(self, frequency_hz: Array, *, scale_feedback: bool) -> Plant:
        """The plant of a loop whose feedback is scale or motor."""
        motor = self.motor(frequency_hz)
        return Plant(frequency_hz, motor, self.scale(frequency_hz) if scale_feedback else motor)

    def _output(self, frequency_hz: Array, shift: float, rigid: float, residues: list[float]) -> Response:
        poles = [(shift * mode.frequency_hz, mode.damping_ratio) for mode in self.modes]
        columns = residue_columns(frequency_hz, self.period_s, self.friction_1_s, self.delay_s, poles)
        return np.asarray(columns @ np.array([rigid, *residues]))


def grid_hz(model: ModalModel) -> Array:
    """Ascending frequencies up to half the sampling rate, dense around the modes."""
    highest_hz = 0.5 / model.period_s
    return with_modes(np.geomspace(LOWEST_HZ, highest_hz * (1.0 - 1e-6), POINTS), (model,))


def with_modes(frequency_hz: Array, models: Sequence[ModalModel]) -> Array:
    """Return ascending frequencies (n,) with further ones around the modes, within the same range."""
    parts = [frequency_hz]
    for mode in (mode for model in models for mode in model.modes):
        width = max(mode.damping_ratio, 1e-3) * mode.frequency_hz
        parts.append(mode.frequency_hz + width * MODE_POINTS)
    grid = np.unique(np.concatenate(parts))
    return np.asarray(grid[(grid >= frequency_hz[0]) & (grid <= frequency_hz[-1])])


def resonances(model: ModalModel) -> tuple[StructuralMode, ...]:
    """Modes whose peak stands out of the rigid response of the motor or of the scale."""
    prominent = []
    for mode in model.modes:
        size = max(abs(mode.motor_1_kg / model.motor_1_kg), abs(mode.scale_1_kg / model.scale_1_kg))
        peak = size / (2.0 * mode.damping_ratio)
        if peak >= LEAST_PROMINENCE and mode.damping_ratio < RESONANT_DAMPING:
            prominent.append(mode)
    return tuple(prominent)


def antiresonances(model: ModalModel) -> tuple[tuple[float, float], ...]:
    """Frequency (Hz) and damping ratio of the motor's antiresonances: what rings while the motor is held.

    They are the zeros of the motor's response: r times the product of all D_k, plus for each mode c_k
    (s^2 + b s) times the product of the other D, with D_k = s^2 + 2 z_k w_k s + w_k^2.
    """
    polynomials = []
    for mode in model.modes:
        w = 2.0 * math.pi * mode.frequency_hz
        polynomials.append(np.array([1.0, 2.0 * mode.damping_ratio * w, w * w]))
    zeros = np.array([model.motor_1_kg])
    for own in polynomials:
        zeros = np.polymul(zeros, own)
    for index, mode in enumerate(model.modes):
        term = mode.motor_1_kg * np.array([1.0, model.friction_1_s, 0.0])
        for other, own in enumerate(polynomials):
            if other != index:
                term = np.polymul(term, own)
        zeros = np.polyadd(zeros, term)
    roots = [complex(root) for root in np.roots(zeros)]
    pairs = [(abs(root) / (2.0 * math.pi), -root.real / abs(root)) for root in roots if root.imag > 0.0]
    highest_hz = 0.5 / model.period_s
    return tuple(
        sorted(
            (hz, damping) for hz, damping in pairs if hz < highest_hz and 0.0 <= damping < RESONANT_DAMPING
        )
    )


def residue_columns(
    frequency_hz: Array,
    period_s: float,
    friction_1_s: float,
    delay_s: float,
    poles: list[tuple[float, float]],
) -> Response:
    """Responses by unit residues, (n, 1 + modes): the rigid mass first, then each pole pair.

    `poles`: frequency (Hz) and damping ratio of each mode. The model is linear in its residues.
    """
    w = 2.0 * math.pi * frequency_hz
    s = 1j * (w[:, np.newaxis] + 2.0 * math.pi / period_s * np.arange(-ALIASES, ALIASES + 1))
    passage = np.exp(-s * (period_s + delay_s)) * (1.0 - np.exp(-1j * w * period_s))[:, np.newaxis]
    passage /= s * period_s
    terms = [passage / (s * s + friction_1_s * s)]
    for pole_hz, damping_ratio in poles:
        wk = 2.0 * math.pi * pole_hz
        terms.append(passage / (s * s + 2.0 * damping_ratio * wk * s + wk * wk))
    return np.stack([term.sum(axis=1) for term in terms], axis=1)
