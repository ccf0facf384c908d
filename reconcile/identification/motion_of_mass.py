"""The motion of the mass, where the motor's encoder shows it with a wave of each turn.

Scale less motor shows the wave of an eccentric encoder, or of a screw. What follows the scale swings by it,
and the force of this, m (2 pi v / lead)^2 times the amplitude, comes back at the same places like a cogging.
How much of the mass follows the scale is fitted: all of it if the encoder is eccentric, the table without the
rotor if the screw errs.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.encoder_eccentricity import ENTRY as ENCODER_ECCENTRICITY
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.lead_error_periodic import ENTRY as LEAD_ERROR_PERIODIC
from reconcile.catalogue.periodic import pair
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.identification.selected_terms import SelectedTerms
from reconcile.recording.recording import AxisRecording
from reconcile.regression.model_presliding import regressed_terms
from reconcile.regression.regression_data import (
    low_pass_of,
    regression_data,
    samples_in_use,
    target_and_baseline,
)

LEAST_FORCE_SHARE = 0.002
"""Least RMS of the force that the wave costs, over that of the force, from which on it is looked at. Chosen:
a fifth of what matters."""
Waves = list[tuple[float, float, float]]
"""Harmonic (1/turn), sine and cosine (m) of each wave of scale less motor."""


class MotionOfMass(NamedTuple):
    """Recordings with the motion of the mass in place of the motor's, and what that is worth."""

    recordings: list[AxisRecording]
    share: float = 0.0
    """Of the mass that follows the scale, 0 to 1."""
    force_n: float = 0.0
    """RMS of the force that the wave costs."""


def motion_of_mass(
    recordings: Sequence[AxisRecording], axis: NominalAxis, deviation: SelectedTerms | None
) -> MotionOfMass:
    """Return the recordings of an axis along the mass, by the waves in its scale less motor.

    `deviation`: the terms of scale less motor, of the recordings with a scale.
    """
    unchanged = MotionOfMass(list(recordings))
    waves = {} if deviation is None else _waves(deviation)
    if not any(waves.values()):
        return unchanged
    own = [waves.get(recording.source, []) for recording in recordings]
    targets, columns = zip(
        *(_force_and_columns(*pair_of, axis) for pair_of in zip(recordings, own, strict=True)), strict=True
    )
    force_n, regressors = np.concatenate(targets), np.concatenate(columns)
    scale = np.linalg.norm(regressors, axis=0) + 1e-300
    theta = np.linalg.lstsq(regressors / scale, force_n, rcond=None)[0] / scale
    if theta[0] <= 0.0:
        return unchanged
    share = float(np.clip(theta[-1] / theta[0], 0.0, 1.0))
    cost_n = share * float(theta[0]) * float(np.sqrt(np.mean(regressors[:, -1] ** 2)))
    if cost_n < LEAST_FORCE_SHARE * float(np.sqrt(np.mean(force_n**2))):
        return unchanged
    moved = [
        _moved(recording, waves_of, share, axis) for recording, waves_of in zip(recordings, own, strict=True)
    ]
    return MotionOfMass(moved, share, cost_n)


def along_model(recording: AxisRecording, axis: NominalAxis) -> AxisRecording:
    """Return a recording along the mass, by the waves of the model."""
    effects = axis.model_effects.effects
    if not effects.keys() & {LEAD_ERROR_PERIODIC.name, ENCODER_ECCENTRICITY.name}:
        return recording
    of_model = regressed_terms(axis, [regression_data(recording, axis)], ResidualChannel.POSITION_DEVIATION)
    waves = _waves_among(of_model)
    is_eccentric = ENCODER_ECCENTRICITY.name in effects
    share = 1.0 if is_eccentric else 1.0 - axis.motor_mass_kg / axis.mass_kg
    return _moved(recording, waves, share, axis)


def _moved(recording: AxisRecording, waves: Waves, share: float, axis: NominalAxis) -> AxisRecording:
    return recording._replace(motor_m=recording.motor_m + share * _wave_m(recording.motor_m, waves, axis))


def _waves_among(terms: Sequence[ModelTerm]) -> Waves:
    return [
        (term.shape_parameters[0], term.coefficients[0], term.coefficients[1])
        for term in terms
        if term.effect == LEAD_ERROR_PERIODIC.name and term.channel is ResidualChannel.POSITION_DEVIATION
    ]


def _waves(deviation: SelectedTerms) -> dict[str, Waves]:
    """Return the waves of each recording by its source: those of the model, and those that were found."""
    problem = deviation.problem
    equations = problem.equations
    slots = equations.slots(deviation.terms)
    blocks = np.concatenate((deviation.train, deviation.held_out))
    weights = equations.denormalised(slots, equations.solve(slots, equations.totals(blocks)))
    waves = {}
    for number, source in enumerate(deviation.inputs.sources):
        waves[source] = _waves_among(problem.model_terms)
        for term, places in equations.placed(deviation.terms):
            if term.effect == LEAD_ERROR_PERIODIC.name:
                here = [float(weights[i]) for i in places if slots[i][1] in (-1, number)]
                waves[source].append((term.shape_parameters[0], here[0], here[1]))
    return waves


def _wave_m(position_m: Array, waves: Waves, axis: NominalAxis) -> Array:
    """Return the waves (n,) at positions of the motor (n,)."""
    turn_rad = 2.0 * np.pi / axis.lead_m * position_m
    total_m = np.zeros(len(position_m))
    for harmonic, sine_m, cosine_m in waves:
        total_m += pair(harmonic * turn_rad) @ np.array([sine_m, cosine_m])
    return total_m


def _force_and_columns(recording: AxisRecording, waves: Waves, axis: NominalAxis) -> tuple[Array, Array]:
    """Return the force (n,) and the columns (n, 5) of mass, friction, a constant and the wave, filtered."""
    data = regression_data(recording, axis)
    target_n, base = target_and_baseline(data, ResidualChannel.FORCE)
    used = samples_in_use(data, ResidualChannel.FORCE)
    swing = low_pass_of(data)(_wave_m(data.motion.position_m, waves, axis), 2)
    return target_n[used], np.column_stack((base, np.ones(len(base)), swing))[used]
