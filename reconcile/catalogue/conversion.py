"""Arguments and results of the conversions between a plant's effect and terms of the catalogue.

`from_plant` turns a `ModelEffect` into `ModelTerm`s; `to_plant` an `IdentifiedTerms` into the parameters
of the plant's effect, by their names in hil_sim, in SI.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from reconcile.catalogue.kinds import RegressionData, ResidualChannel, ShapeParameters
from reconcile.formats.nominal_axis import NominalAxis

PlantValues = dict[str, Any]
"""By parameter: a number, a list of numbers, or the name of another axis."""


class NotInAPlant(Exception):  # noqa: N818  # not an error: the verdict reports it
    """No plant can have what was identified; the message says why."""


class ModelTerm(NamedTuple):
    """A term of the catalogue that a model already has."""

    effect: str
    shape_parameters: ShapeParameters
    coefficients: tuple[float, ...]
    """Coefficients of the columns at these shape parameters."""
    channel: ResidualChannel = ResidualChannel.FORCE


class ModelEffect(NamedTuple):
    """One effect of a plant, with the axis and recordings that its parameters refer to."""

    effect: str
    params: Any
    """hil_sim's `Params`, SI."""
    effects: Mapping[str, Any]
    """All effects that the model has on the axis."""
    other: str
    """The axis that the effect follows; empty if it follows none."""
    axis: NominalAxis
    base: Mapping[str, float]
    """mass_kg, viscous_n_s_m, coulomb_n: total mass and friction."""
    datasets: Sequence[RegressionData]
    """At least one."""


class IdentifiedTerms(NamedTuple):
    """An identified effect, with the axis and recordings that its parameters refer to."""

    effect: str
    channel: ResidualChannel
    terms: Sequence[Mapping[str, float]]
    """Parameters of each term of the finding."""
    datasets: Sequence[RegressionData]
    base: Mapping[str, float]
    """mass_kg, viscous_n_s_m, coulomb_n as fitted to the force; empty if they were not."""
    axis: NominalAxis
    shapes: Sequence[ShapeParameters] = ()
    """Shape parameters of each term, where the terms are judged (`veto`)."""
