"""Terms that a regression finds in the nominal model itself, simulated along the same motion.

A plant with a soft spring, backlash or a swinging mass is no sum of columns. A recording of that very plant
has a residual where the columns miss it, and terms can be fitted to this misfit. Fitted to a simulation of
the model, the same terms are as large; so a term that the simulation shows too is none that the model lacks.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hil_sim.config import ConfigError, load_plant
from reconcile.catalogue.drive_compliance import ENTRY as DRIVE_COMPLIANCE
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.registry import TIMING
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.transport_delay import ENTRY as DELAY
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.identification.accounted import UNNAMED, accounted
from reconcile.identification.compared_models import nominal_coefficients
from reconcile.identification.explain import Explanation, without
from reconcile.identification.term_search import FoundTerms
from reconcile.nominal_model.model_file import NominalModel
from reconcile.recording.recording import AxisRecording
from reconcile.regression.candidate_term import effect_names
from reconcile.regression.model_presliding import regressed_terms
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import regression_problem
from reconcile.regression.residual import rms
from reconcile.replay.along_reference import along_reference
from reconcile.replay.model_along_motion import along_motion
from reconcile.selection.predictive_terms import WithdrawnEffect

IMAGE_SHARE = 0.5
"""Size of a term in the simulation over that in the recording, from which on it is the model's own. Chosen:
an effect that the model lacks is not in the simulation at all."""
MOST_RESIDUAL_RATIO = 1.3
"""Residual of a rigid model on the simulation over that on the recording, above which the simulation is not
used: the true plant would not leave more there than in the recording. Chosen."""
SPRING = DRIVE_COMPLIANCE.name
"""A spring that the model has already is not named again from the motor alone: no column is exact there."""
LONGEST_S = 300.0
"""Longest motion that is simulated, s, in all recordings of an axis; beyond it no term is compared."""


def recordings_of_model(recordings: Sequence[AxisRecording], model: NominalModel) -> list[AxisRecording]:
    """Simulations of the model along the recordings; empty where it is rigid, or hil_sim refuses it."""
    axis = model.axes[recordings[0].axis]
    lasting_s = sum(len(one.time_s) * one.period_s for one in recordings)
    if not axis.model_effects.effects or lasting_s > LONGEST_S:
        return []
    try:
        plant = load_plant(model.file)
    except ConfigError:
        return []
    made = [along_reference(one, plant) or along_motion(one, plant) for one in recordings]
    return made if all(np.isfinite(one.force_n).all() for one in made) else []


class _Image(NamedTuple):
    """RMS in the simulation of the model, N or m."""

    effects: dict[str, float]
    residual: float
    """With the terms fitted."""
    refitted: float
    """Residual after refitting mass and friction."""
    refitting: float
    """What refitting mass and friction removes."""


def without_image(
    explanation: Explanation, recordings: Sequence[AxisRecording], axis: NominalAxis
) -> Explanation:
    """The explanation without the terms that `recordings`, simulated with the model, show as well."""
    sizes = explanation.accounted
    found = explanation.found
    if not recordings or found is None or sizes is None:
        return explanation
    image = _image(found, explanation.channel, recordings, axis)
    if image.refitted > MOST_RESIDUAL_RATIO * rms(explanation.residuals, "refitted"):
        return explanation
    terms = found.terms
    own = [
        effect
        for effect in effect_names(terms)
        if image.effects.get(_row(effect), 0.0) >= IMAGE_SHARE * sizes.effects.get(_row(effect), math.inf)
        or (effect == SPRING and effect in axis.model_effects.effects and _is_force(explanation))
    ]
    if own:
        gone = {"unknown" if effect.startswith(PREFIX) else effect for effect in own}
        fitted = without(explanation, gone)
        why = "the model itself, simulated along this motion, shows it as well"
        more = [WithdrawnEffect(effect, why) for effect in own if not effect.startswith(PREFIX)]
        fitted = fitted._replace(withdrawn=(*fitted.withdrawn, *more))
        return without_image(fitted, recordings, axis)
    findings = list(explanation.findings)
    if image.residual >= IMAGE_SHARE * sizes.residual:
        findings = [f for f in findings if f.effect != "unknown" or f.candidates]
    before, refitted = explanation.before.train, explanation.refitted.train
    removed = math.sqrt(max(before**2 - refitted**2, 0.0))
    return explanation._replace(
        findings=findings,
        accounted=sizes._replace(noise=min(math.hypot(sizes.noise, image.residual), sizes.residual)),
        parameters_matter=explanation.parameters_matter and image.refitting < IMAGE_SHARE * removed,
    )


def _is_force(explanation: Explanation) -> bool:
    return explanation.channel is ResidualChannel.FORCE


def _row(effect: str) -> str:
    """The name of an effect in `accounted`."""
    return UNNAMED if effect.startswith(PREFIX) else effect


def _image(
    found: FoundTerms, channel: ResidualChannel, recordings: Sequence[AxisRecording], axis: NominalAxis
) -> _Image:
    """Fit the terms that were found in a channel to the simulated `recordings`."""
    if channel is ResidualChannel.POSITION_DEVIATION:
        recordings = [one for one in recordings if one.scale_m is not None]
    data = [regression_data(one, axis) for one in recordings]
    shapes = [(c.effect, c.shape_parameters) for c in found.terms]
    if channel is ResidualChannel.FORCE and not any(c.effect in TIMING for c in found.terms):
        shapes += [(DELAY.name, shape) for shape in DELAY.terms[0].shapes(data)[:1]]
    known = regressed_terms(axis, data, channel)
    problem = regression_problem(data, channel, shapes, only=True, model_terms=known)
    equations = problem.equations
    keys = [c.key for c in found.terms]
    timing = [c for c in equations.candidates if c.effect in TIMING]  # the image has no delay
    terms = [*timing, *(equations.by_key[key] for key in keys if key[0] not in TIMING)]
    blocks = np.arange(len(equations.samples))
    totals, samples = equations.totals(blocks), max(int(equations.samples.sum()), 1)
    slots, base = equations.slots(terms), equations.slots(timing)
    weights = equations.denormalised(slots, equations.solve(slots, totals))
    sizes = accounted(problem, terms, weights, noise=0.0, share=found.inputs.rules.negligible_force_share)
    rigid = equations.solve(base, totals)
    given = nominal_coefficients(axis, problem, rigid) if channel is ResidualChannel.FORCE else rigid
    squares = [float(equations.squares(base, theta, blocks).sum()) / samples for theta in (given, rigid)]
    return _Image(
        sizes.effects, sizes.residual, math.sqrt(squares[1]), math.sqrt(max(squares[0] - squares[1], 0.0))
    )
