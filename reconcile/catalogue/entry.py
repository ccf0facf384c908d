"""The declaration of an effect in the catalogue: everything that reconcile knows of it, in one place.

Each module of this package that describes an effect ends with `ENTRY = CatalogueEntry(...)`. The registry
finds them; no table elsewhere names an effect.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import ModuleType
from typing import NamedTuple

from kernels.arrays import Array
from kernels.quantities import Quantity, fields_of, section_of
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm, PlantValues
from reconcile.catalogue.kinds import (
    RegressionData,
    ResidualChannel,
    ShapeParameters,
    SiParameter,
    TermFamily,
)

Interval = tuple[float, float]
"""Lower and upper end of a 95 % interval."""
Intervals = Callable[
    [Mapping[str, float], Mapping[str, Interval], Sequence[RegressionData]], dict[str, Interval]
]
"""Arguments: values of an effect's parameters, their intervals by resampling, and the recordings."""
POSITIVE = (0.0, math.inf)
"""A value of `CatalogueEntry.physical`."""


class Rival(NamedTuple):
    """Another effect for which this one is often mistaken."""

    effect: str
    distinguished_by: str = ""
    """The observation that distinguishes them; empty where the rival's entry states it."""
    experiment: str = ""
    """Name of the manual experiment that distinguishes them; empty if a motion does."""


class TypicalSizes(NamedTuple):
    """Friction, force and travel of an axis, by which the size of an effect is plausible; SI."""

    coulomb_n: float
    large_n: float
    """Plausible size of a friction."""
    small_n: float
    """Plausible size of a ripple."""
    peak_n: float
    fastest_m_s: float
    over_travel: ShapeParameters
    """Shape parameters of a parabola over the travel (`polynomial`)."""


class PlausibleTerm(NamedTuple):
    """A term of a size that machines have."""

    shape_parameters: ShapeParameters
    coefficients: tuple[float, ...]
    channel: ResidualChannel | None = None
    """The only channel that shows it; None: any in which the effect has terms."""


class IndicatorKind(NamedTuple):
    """A quantity that the watch of a machine measures by a term of fixed shape parameters."""

    name: str
    unit: str
    words: str
    shape_parameters: ShapeParameters = ()
    factor: float = 1.0
    """The indicator is the coefficient times this."""
    beside: bool = False
    """Fitted together with the others; else after them, so that it widens no other interval."""
    effect: str = ""
    """Filled in from the entry; empty for a coefficient of the rigid model."""
    channel: ResidualChannel | None = None
    """The only channel in which it is measured; None: any in which the effect has terms."""


@dataclass(frozen=True, kw_only=True)
class CatalogueEntry:
    """One effect of hil_sim, as the engine looks for it, names it, reports it and writes it into a model.

    An entry without `terms` cannot be identified; it declares the terms that equal the plant's effect
    (`from_plant`) and its rivals. If `coefficients` and `shape_parameters` are parameters of the plant's
    effect, no conversion is declared.
    """

    physics: ModuleType
    """hil_sim's module: name, law, units and bounds."""

    # candidate terms
    terms: tuple[TermFamily, ...] = ()
    """At most one family for each residual channel."""
    physical: tuple[float, float] | None = None
    """Open interval of the physically possible first coefficients; None: any."""
    additive: bool = False
    """The effect is a sum of terms with different shape parameters; other effects are a single term."""
    continuous_shape_parameters: int = 0
    """Number of leading shape parameters that are continuous, and refined; 0: all are discrete."""
    drifting_columns: int = 0
    """Leading columns that change within a recording; the others are its levels. 0: no levels."""
    timing: bool = False
    """A shift in time: below one sample it comes from sampling, not from physics."""
    presliding_can_imitate: bool = False
    """It resembles the misfit of a presliding of another curve."""
    shows_after_presliding: bool = False
    """Such an effect must also show where presliding is over."""
    ends_with_reversal: bool = False
    """The first shape parameter is a distance; if the filters do not resolve it, the effect is a step."""

    # report
    coefficients: Mapping[str, str] = field(default_factory=dict)
    """SI unit of each coefficient, by the name of its parameter."""
    shape_parameters: Mapping[str, str] = field(default_factory=dict)
    """SI unit of each shape parameter, by its name."""
    sign: float = 1.0
    """-1 if the parameters are forces on the table: the motor must give the opposite."""
    parameters_of: Callable[[ShapeParameters, Array], dict[str, SiParameter]] | None = None
    """Parameters (SI) from shape parameters and coefficients, if they are not parameters themselves."""
    sentence: Callable[[dict[str, float]], str] = lambda _parameters: ""
    """Sentence with an observation that an engineer can check."""
    systematic: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """By parameter: systematic errors below and above its value, as shares of it."""
    intervals: Intervals = lambda _values, _resampled, _datasets: {}
    """95 % intervals of parameters of which resampling does not tell all, as of shape parameters."""
    equivalent: tuple[str, ...] = ()
    """Effects that these sensors cannot distinguish from it."""
    on_every_axis: bool = False
    """Every axis has it: a rarer effect of at least half its size is reported first."""
    mean_of: str = ""
    """Effect of which it is the mean, because its zero is unknown; reported after that effect."""
    curve_over: str = ""
    """Coordinate over which any curve of force is this law, if its own terms do not fit."""
    curve_near: str = ""
    """Coordinate over which a curve is this law with another shape, if its terms explain nearly as much."""
    indicators: tuple[IndicatorKind, ...] = ()

    # the plant
    to_plant: Callable[[IdentifiedTerms, list[str]], PlantValues] = lambda found, _notes: dict(found.terms[0])
    """Parameters of the plant's effect; may raise NotInAPlant, and notes deviations from the findings."""
    plant_effect: Callable[[IdentifiedTerms], str] | None = None
    """Name of hil_sim's effect that is written, if it is not always the entry's own."""
    from_plant: Callable[[ModelEffect], Sequence[ModelTerm]] | None = None
    """Terms that equal the plant's effect, if its parameters are not those of the term."""
    refused: Callable[[IdentifiedTerms], str] = lambda _found: ""
    """Reason why such an effect is impossible, besides bounds and sign; empty if possible (`veto`)."""
    fixed_to_screw: bool = False
    """Its phase is fixed to the screw, so it depends on the encoder's zero within a turn."""

    # the next experiment
    rivals: tuple[Rival, ...] = ()
    """Effects with which it is confused, the most likely first."""
    shown_by: str = ""
    """The observation that shows it, for any rival."""
    experiment: str = ""
    """Name of the manual experiment that shows it; empty if a motion does."""
    plausible: Callable[[TypicalSizes], Sequence[PlausibleTerm]] = lambda _sizes: ()
    """Terms of the sizes that it may have without having been identified."""
    rank: int = 100
    """Order of equally valuable questions: an effect that is more common on machines has a lower rank."""

    @property
    def name(self) -> str:
        """The effect's name: hil_sim's file, the section of the plant file, the word in a verdict."""
        return section_of(self.physics)

    @property
    def bounds(self) -> dict[str, Quantity]:
        """By parameter of the plant's effect: its unit and bounds."""
        return {parameter.name: parameter.quantity for parameter in fields_of(self.physics.Params)}

    def written_as(self, found: IdentifiedTerms) -> str:
        """Return the section of a plant file that holds the identified effect."""
        return self.name if self.plant_effect is None else self.plant_effect(found)

    def family(self, channel: ResidualChannel) -> TermFamily | None:
        """Return the candidate terms in a residual channel; None if there are none."""
        return next((family for family in self.terms if family.channel is channel), None)

    def possible(self, coefficients: Array) -> bool:
        """Return whether the coefficients are physically possible."""
        return self.physical is None or bool(self.physical[0] < coefficients[0] < self.physical[1])

    def parameters(self, shape_parameters: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
        """Return the parameters (SI) of shape parameters and coefficients; undeclared columns have none."""
        if self.parameters_of is not None:
            return self.parameters_of(shape_parameters, coefficients)
        by_coefficient = zip(self.coefficients.items(), self.sign * coefficients, strict=False)
        by_shape = zip(self.shape_parameters.items(), shape_parameters, strict=False)
        return {name: SiParameter(float(value), unit) for (name, unit), value in (*by_coefficient, *by_shape)}

    def model_terms(self, of: ModelEffect) -> Sequence[ModelTerm]:
        """Return the terms that equal the plant's effect."""
        if self.from_plant is not None:
            return self.from_plant(of)
        shape_parameters = tuple(getattr(of.params, name) for name in self.shape_parameters)
        coefficients = tuple(self.sign * getattr(of.params, name) for name in self.coefficients)
        channel = self.terms[0].channel if self.terms else ResidualChannel.FORCE
        return [ModelTerm(self.name, shape_parameters, coefficients, channel)]
