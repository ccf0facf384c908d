"""Terms that a regression also finds in a simulation of the nominal model: the misfit of its own columns.

A plant with a soft spring, backlash or a swinging mass is not a sum of columns. A recording of that plant has
a residual where the columns do not fit it, and terms can be fitted to this misfit. Fitted to a simulation of
the nominal model along the same motion, they are as large. Such a term is not one that the model lacks.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hil_sim.config import ConfigError, load_plant
from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import of_kind
from kernels.quantities import section_of
from reconcile.catalogue.drive_compliance import ENTRY as DRIVE_COMPLIANCE
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.registry import TIMING
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.transport_delay import ENTRY as DELAY
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.identification.accounted import UNNAMED, accounted
from reconcile.identification.compared_models import nominal_coefficients
from reconcile.identification.explain import Explanation, without
from reconcile.identification.selected_terms import SelectedTerms
from reconcile.nominal_model.model_file import NominalModel
from reconcile.recording.recording import AxisRecording
from reconcile.regression.candidate_term import effect_names
from reconcile.regression.model_presliding import regressed_terms
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import regression_problem
from reconcile.regression.residual import rms, rms_between
from reconcile.replay.along_reference import along_reference
from reconcile.replay.model_along_motion import along_motion
from reconcile.selection.predictive_terms import WithdrawnEffect

LEAST_SIMULATED_RATIO = 0.5
"""Size of a term in the simulation over that in the recording, from which on it is the model's own. Chosen:
an effect that the model lacks is not in the simulation at all."""
MOST_RESIDUAL_RATIO = 1.3
"""Residual of a rigid model on the simulation over that on the recording, above which the simulation is not
used: the true plant would not leave more there than in the recording. Chosen."""
SPRING = DRIVE_COMPLIANCE.name
"""A spring that the model has already is not named again from the motor alone: no column is exact there."""
FORCES_OF_OTHER_AXIS = {section_of(module) for module in of_kind(Kind.FORCE_OF_OTHER_AXIS)}
LONGEST_SIMULATION_S = 300.0
"""Duration of all recordings of an axis, s, above which nothing is simulated: bounds the time; chosen."""


def simulated_recordings(recordings: Sequence[AxisRecording], model: NominalModel) -> list[AxisRecording]:
    """Simulate the model along the recordings.

    None where it is rigid, where another axis pushes this one, or where hil_sim cannot load it.
    """
    axis = model.axes[recordings[0].axis]
    duration_s = sum(len(recording.time_s) * recording.period_s for recording in recordings)
    effects = axis.model_effects.effects
    if not effects or effects.keys() & FORCES_OF_OTHER_AXIS or duration_s > LONGEST_SIMULATION_S:
        return []
    try:
        plant = load_plant(model.file)
    except ConfigError:
        return []
    simulated = [
        along_reference(recording, plant) or along_motion(recording, plant) for recording in recordings
    ]
    return simulated if all(np.isfinite(one.force_n).all() for one in simulated) else []


def without_simulated_terms(
    explanation: Explanation, simulated: Sequence[AxisRecording], axis: NominalAxis
) -> Explanation:
    """The explanation without the terms that `simulated` recordings of the model show as well."""
    sizes, selected = explanation.accounted, explanation.selected
    if not simulated or selected is None or sizes is None:
        return explanation
    simulation = _fit_to_simulation(selected, explanation.channel, simulated, axis)
    if simulation.rigid_residual > MOST_RESIDUAL_RATIO * rms(explanation.residuals, "refitted"):
        return explanation
    of_model = [
        effect
        for effect in effect_names(selected.terms)
        if _is_as_large(effect, simulation.effects, sizes.effects)
        or (effect == SPRING and effect in axis.model_effects.effects and _is_force(explanation))
    ]
    if of_model:
        fewer = without(explanation, {"unknown" if e.startswith(PREFIX) else e for e in of_model})
        why = "the model itself, simulated along this motion, shows it as well"
        withdrawn = [WithdrawnEffect(effect, why) for effect in of_model if not effect.startswith(PREFIX)]
        fewer = fewer._replace(withdrawn=(*fewer.withdrawn, *withdrawn))
        return without_simulated_terms(fewer, simulated, axis)
    findings = list(explanation.findings)
    if simulation.residual >= LEAST_SIMULATED_RATIO * sizes.residual:
        findings = [f for f in findings if f.effect != "unknown" or f.candidates]
    nominal, refitted = explanation.before.train, explanation.refitted.train
    removed = rms_between(nominal, refitted)
    return explanation._replace(
        findings=findings,
        accounted=sizes._replace(noise=min(math.hypot(sizes.noise, simulation.residual), sizes.residual)),
        nominal_is_worse=explanation.nominal_is_worse
        and simulation.removed_by_refit < LEAST_SIMULATED_RATIO * removed,
    )


def _is_force(explanation: Explanation) -> bool:
    return explanation.channel is ResidualChannel.FORCE


def _is_as_large(effect: str, simulated: Mapping[str, float], recorded: Mapping[str, float]) -> bool:
    """Whether an effect has a similar RMS in the simulation; unnamed terms are compared together."""
    name = UNNAMED if effect.startswith(PREFIX) else effect
    return simulated.get(name, 0.0) >= LEAST_SIMULATED_RATIO * recorded.get(name, math.inf)


class _SimulationFit(NamedTuple):
    """RMS in the simulation of the model, N or m."""

    effects: dict[str, float]
    residual: float
    """With all terms fitted."""
    rigid_residual: float
    """With mass and friction refitted, without terms."""
    removed_by_refit: float
    """What refitting mass and friction removes."""


def _fit_to_simulation(
    selected: SelectedTerms, channel: ResidualChannel, simulated: Sequence[AxisRecording], axis: NominalAxis
) -> _SimulationFit:
    """Fit the selected terms of a channel to the `simulated` recordings."""
    if channel is ResidualChannel.POSITION_DEVIATION:
        simulated = [recording for recording in simulated if recording.scale_m is not None]
    datasets = [regression_data(recording, axis) for recording in simulated]
    shapes = [(c.effect, c.shape_parameters) for c in selected.terms]
    if channel is ResidualChannel.FORCE and not any(c.effect in TIMING for c in selected.terms):
        shapes += [(DELAY.name, shape) for shape in DELAY.terms[0].shapes(datasets)[:1]]
    model_terms = regressed_terms(axis, datasets, channel)
    problem = regression_problem(datasets, channel, shapes, only=True, model_terms=model_terms)
    equations = problem.equations
    # timing is refitted: the simulation does not have the delay of the recording
    timing = [c for c in equations.candidates if c.effect in TIMING]
    terms = [*timing, *(equations.by_key[c.key] for c in selected.terms if c.effect not in TIMING)]
    blocks = np.arange(len(equations.samples))
    totals, samples = equations.totals(blocks), max(int(equations.samples.sum()), 1)
    slots, rigid_slots = equations.slots(terms), equations.slots(timing)
    weights = equations.denormalised(slots, equations.solve(slots, totals))
    sizes = accounted(problem, terms, weights, noise=0.0, share=selected.inputs.rules.negligible_force_share)
    refitted = equations.solve(rigid_slots, totals)
    is_force = channel is ResidualChannel.FORCE
    nominal = nominal_coefficients(axis, problem, refitted) if is_force else refitted
    nominal_square, refitted_square = (
        float(equations.squares(rigid_slots, theta, blocks).sum()) / samples for theta in (nominal, refitted)
    )
    return _SimulationFit(
        effects=sizes.effects,
        residual=sizes.residual,
        rigid_residual=math.sqrt(refitted_square),
        removed_by_refit=math.sqrt(max(nominal_square - refitted_square, 0.0)),
    )
