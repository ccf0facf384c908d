"""The physical veto: reasons why fitted terms cannot be the effect that they are named after.

Cross-validation tests whether a term predicts, not whether its values are possible. A negative friction, a
temperature below absolute zero or a ripple fitted to a part of one turn may predict well, but is another
effect. Bounds and units are those of the effect's own file in hil_sim; conditions of one effect (its sign,
the least change of temperature) are declared by its entry.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hil_sim.physics.kinds import Kind
from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, ModelTerm, NotInAPlant
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.catalogue.periodic import covers_turns
from reconcile.catalogue.periodic_disturbance import NYQUIST_SHARE
from reconcile.catalogue.registry import CATALOGUE, ENTRIES, has_levels
from reconcile.formats.nominal_axis import NominalAxis

MOST_COLLINEAR = 0.995
"""Largest multiple correlation of a term with the baseline, at which 10 % of its amplitude is independent."""
PUSHING_SHARE = 0.05
"""Largest share of the moving samples in which fitted friction may push, at the edges of the data; chosen."""
PUSHING_LEVEL = 0.1
"""Share of the Coulomb friction below which a pushing friction is scatter; chosen."""
ROUNDING = 1e-9
"""Relative excess over a bound that is not a violation of it."""
OPPOSES_MOTION = {
    Kind.FRICTION_LEVEL,
    Kind.FRICTION_SPEED,
    Kind.FRICTION_LOAD,
    Kind.FRICTION_POSITION,
    Kind.FRICTION_DWELL,
    Kind.DAMPING,
    Kind.FRICTION_CHANGE,
}
"""Kinds of effects whose force, with all other friction, must oppose the motion."""


class VetoContext(NamedTuple):
    """Model and recordings of the judged terms."""

    datasets: Sequence[RegressionData]
    """At least one."""
    axis: NominalAxis
    base: Mapping[str, float]
    """mass_kg, viscous_n_s_m, coulomb_n as fitted beside all terms; empty where they were not."""
    model: Sequence[ModelTerm] = ()
    """All terms of the model, including the judged ones: friction is judged in total."""
    highest_hz: float = math.inf
    """Bandwidth of the regression's filter."""
    prediction: Array | None = None
    """(n,) filtered prediction of the terms in the used samples of all recordings."""
    baseline: Array | None = None
    """(n, k) the columns of the baseline parameters in the same samples."""


def veto(entry: CatalogueEntry, terms: Sequence[ModelTerm], context: VetoContext) -> str:
    """Return why these terms cannot be the entry's effect, for the report; empty if they can."""
    coefficients = [np.array(term.coefficients, dtype=np.float64) for term in terms]
    if not all(np.isfinite(of).all() for of in coefficients):
        return "its coefficients are not finite"
    parameters = [
        {name: p.value for name, p in entry.parameters(term.shape_parameters, of).items()}
        for term, of in zip(terms, coefficients, strict=True)
    ]
    period_s = context.datasets[0].period_s
    if entry.timing and abs(parameters[0]["time_s"]) < period_s:
        return ""  # from sampling, not from physics
    channel = terms[0].channel
    found = IdentifiedTerms(
        effect=entry.name,
        channel=channel,
        terms=parameters,
        datasets=context.datasets,
        base=context.base,
        axis=context.axis,
        shapes=[term.shape_parameters for term in terms],
    )
    reasons = (
        *(_sign(entry, of) for of in coefficients),
        entry.refused(found),
        *(_turns(entry, term, context) for term in terms),
        *(_frequency(of, context) for of in parameters),
        _bounds(entry, found),
        _pushes(entry, context) if channel is ResidualChannel.FORCE else "",
        _is_baseline(context),
    )
    return next((reason for reason in reasons if reason), "")


def collinearity(prediction: Array, baseline: Array) -> float:
    """Multiple correlation, 0 to 1, of a prediction (n,) with the columns (n, k) and a constant."""
    size = float(np.linalg.norm(prediction))
    if size == 0.0:
        return 1.0
    columns = baseline
    if float(np.ptp(prediction)) > 1e-9 * float(np.abs(prediction).max()):
        columns = np.concatenate((baseline, np.ones((len(prediction), 1))), axis=1)
    lengths = np.linalg.norm(columns, axis=0)
    basis, values, _ = np.linalg.svd(columns / np.where(lengths > 0.0, lengths, 1.0), full_matrices=False)
    basis = basis[:, values > 1e-9 * values[0]]
    return float(np.linalg.norm(basis.T @ prediction)) / size


def _sign(entry: CatalogueEntry, coefficients: Array) -> str:
    if entry.possible(coefficients) or entry.physical is None:
        return ""
    low, high = entry.physical
    return f"its size was fitted to be {coefficients[0]:.3g}, and lies between {low:g} and {high:g} in nature"


def _turns(entry: CatalogueEntry, term: ModelTerm, context: VetoContext) -> str:
    if not entry.fixed_to_screw or covers_turns(context.datasets, term.shape_parameters[0]):
        return ""
    return "it repeats with the turn, and the recordings do not cover two of its periods and a whole turn"


def _frequency(parameters: Mapping[str, float], context: VetoContext) -> str:
    frequency_hz = parameters.get("frequency_hz", 0.0)
    nyquist_hz = 0.5 / max(data.period_s for data in context.datasets)
    highest_hz = min(NYQUIST_SHARE * nyquist_hz, context.highest_hz)
    if frequency_hz <= highest_hz:
        return ""
    return f"{frequency_hz:.4g} Hz are above the {highest_hz:.4g} Hz that these recordings can show"


def _bounds(entry: CatalogueEntry, found: IdentifiedTerms) -> str:
    """Return a value outside the plant's bounds; effects without a plant section have none."""
    try:
        values = entry.to_plant(found, [])
    except NotInAPlant:
        return ""
    for name, quantity in CATALOGUE[entry.written_as(found)].bounds.items():
        given = values.get(name)
        if given is None or isinstance(given, str):
            continue
        for value in given if isinstance(given, list) else [given]:
            margin = ROUNDING * max(abs(quantity.lower), abs(quantity.upper))
            if not quantity.lower - margin <= value <= quantity.upper + margin:
                unit = quantity.file_unit or quantity.unit
                low, high, own = (quantity.from_si(one) for one in (quantity.lower, quantity.upper, value))
                would_be = f"{own:.4g} {unit}".rstrip()
                return f"{quantity.meaning} would be {would_be}, and is {low:g} to {high:g}"
    return ""


def _pushes(entry: CatalogueEntry, context: VetoContext) -> str:
    """Return the reason if the total friction does not oppose the motion."""
    if entry.physics.KIND not in OPPOSES_MOTION or not context.base:
        return ""
    friction = [
        term
        for term in context.model
        if term.effect in ENTRIES and ENTRIES[term.effect].physics.KIND in OPPOSES_MOTION
    ]
    own_levels = any(has_levels(term.effect, len(term.coefficients)) for term in friction)
    shares, level_n = [], context.base["coulomb_n"]
    for data in context.datasets[:1] if own_levels else context.datasets:
        m = data.motion
        total_n = level_n * m.direction + context.base["viscous_n_s_m"] * m.velocity_m_s
        for term in friction:
            family = ENTRIES[term.effect].family(term.channel)
            if family is not None:
                total_n = total_n + family.columns(data, term.shape_parameters) @ np.array(term.coefficients)
        against_n = (total_n * m.direction)[m.moving]
        shares.append(float(np.mean(against_n < -PUSHING_LEVEL * abs(level_n))) if len(against_n) else 0.0)
    worst = max(shares)
    if worst <= PUSHING_SHARE:
        return ""
    return f"with it all of the friction would push in {100.0 * worst:.0f} % of the motion"


def _is_baseline(context: VetoContext) -> str:
    if context.prediction is None or context.baseline is None or not len(context.prediction):
        return ""
    share = collinearity(context.prediction, context.baseline)
    if share <= MOST_COLLINEAR:
        return ""
    return (
        f"in this motion it is mass, friction and a constant to {100.0 * share:.1f} % (correlation): "
        "nothing tells them apart"
    )
