"""The declaration of an effect in the catalogue: all that the rooms of reconcile know of it, in one place.

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

HalfWidths = Callable[[Mapping[str, float], Mapping[str, float], Sequence[RegressionData]], dict[str, float]]
"""Of the values of an effect's parameters, half widths of their intervals, and the recordings."""
POSITIVE = (0.0, math.inf)
"""Of `CatalogueEntry.physical`."""


class Rival(NamedTuple):
    """Another effect for which this one is often mistaken."""

    effect: str
    distinguished_by: str = ""
    """The observation that distinguishes them; empty where the rival's entry states it."""
    experiment: str = ""
    """The experiment by hand that it takes, by name; empty where a motion does."""


class TypicalSizes(NamedTuple):
    """Friction, force and travel of an axis, by which the size of an effect is plausible; SI."""

    coulomb_n: float
    large_n: float
    """Plausible for a friction."""
    small_n: float
    """Plausible for a ripple."""
    peak_n: float
    fastest_m_s: float
    over_travel: ShapeParameters
    """A parabola over the travel, as `polynomial` has it."""


class PlausibleTerm(NamedTuple):
    """A term of a size that machines have."""

    shape_parameters: ShapeParameters
    coefficients: tuple[float, ...]
    channel: ResidualChannel | None = None
    """The only one that it shows in; None: any that the effect has terms in."""


class IndicatorKind(NamedTuple):
    """What the watch of a machine measures with a term of fixed shape parameters."""

    name: str
    unit: str
    words: str
    shape_parameters: ShapeParameters = ()
    factor: float = 1.0
    """The indicator is the coefficient times this."""
    beside: bool = False
    """Fitted beside the others; else after them, so that it widens no other error."""
    effect: str = ""
    """Filled in from the entry; empty for a coefficient of the rigid model."""
    channel: ResidualChannel | None = None
    """The only one that it is measured in; None: any that the effect has terms in."""


@dataclass(frozen=True, kw_only=True)
class CatalogueEntry:
    """One effect of hil_sim, as the engine looks for it, names it, reports it and writes it into a model.

    An entry without `terms` cannot be identified by itself; it says what the plant's effect looks like
    (`from_plant`) and what it is confused with. Where `coefficients` and `shape_parameters` are parameters of
    the plant's effect, they are all that is needed to report it, to write it and to read it.
    """

    physics: ModuleType
    """hil_sim's module: name, law, units and bounds."""

    # what the regression tries
    terms: tuple[TermFamily, ...] = ()
    """At most one family a residual channel."""
    physical: tuple[float, float] | None = None
    """Open interval of the first coefficient in nature; None: it may be anything."""
    additive: bool = False
    """A sum of terms with different shape parameters; of other effects one set of them is the best."""
    continuous_shape_parameters: int = 0
    """How many of the first ones may take any value, and are refined; 0: they are a list."""
    drifting_columns: int = 0
    """Columns that change within a recording; those after them are levels of each recording. 0: no levels."""
    timing: bool = False
    """A shift in time: below one sample it is how the channels were sampled, and no physics."""
    presliding_can_imitate: bool = False
    """It can pass for the residual of a presliding that follows another curve than its term."""
    shows_after_presliding: bool = False
    """Of these: it must also show where presliding is over."""
    ends_with_reversal: bool = False
    """The first shape parameter is a distance; below what the filters resolve of a reversal it is a step."""

    # what is reported
    coefficients: Mapping[str, str] = field(default_factory=dict)
    """Unit of each coefficient by the parameter that it is, SI."""
    shape_parameters: Mapping[str, str] = field(default_factory=dict)
    """The same of the shape parameters."""
    sign: float = 1.0
    """-1 where the parameters are forces on the table: the motor has to give the opposite."""
    parameters_of: Callable[[ShapeParameters, Array], dict[str, SiParameter]] | None = None
    """What shape parameters and coefficients mean, SI, where they are no parameters themselves."""
    sentence: Callable[[dict[str, float]], str] = lambda _parameters: ""
    """What an engineer can check."""
    systematic: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """By parameter: shares of its value by which the truth may lie below and above it, beside the scatter."""
    spread: HalfWidths = lambda _values, _half_widths, _datasets: {}
    """Half widths of the 95 % intervals of shape parameters; coefficients have theirs by resampling."""
    equivalent: tuple[str, ...] = ()
    """Effects that these sensors cannot tell from it."""
    on_every_axis: bool = False
    """Every axis has some of it: a rarer effect of half its size is reported first."""
    mean_of: str = ""
    """It is the mean of that effect, whose zero is unknown: reported after it."""
    curve_over: str = ""
    """Coordinate over which a force of any curve is this law, where its own terms do not fit."""
    curve_near: str = ""
    """Coordinate over which a curve is this law of another shape, if its own terms explain nearly as much."""
    indicators: tuple[IndicatorKind, ...] = ()

    # the plant
    to_plant: Callable[[IdentifiedTerms, list[str]], PlantValues] = lambda found, _notes: dict(found.terms[0])
    """Parameters of the plant's effect; may raise NotInAPlant, and notes what is not as it was found."""
    plant_effect: Callable[[IdentifiedTerms], str] | None = None
    """The effect of hil_sim that holds what was found, by name, where it is not always the entry's own."""
    from_plant: Callable[[ModelEffect], Sequence[ModelTerm]] | None = None
    """The terms that the plant's effect is, where its parameters are not those of the term."""
    refused: Callable[[IdentifiedTerms], str] = lambda _found: ""
    """Why nature has no such effect, beside bounds and signs; empty where it may have it (`veto`)."""
    fixed_to_screw: bool = False
    """Its phase is fixed to the screw: a recording whose zero is shifted within a turn shows it."""

    # the next experiment
    rivals: tuple[Rival, ...] = ()
    """In the order in which they are doubted."""
    shown_by: str = ""
    """What shows it, for any rival."""
    experiment: str = ""
    """The experiment by hand without which it hardly shows, by name; empty where a motion shows it."""
    plausible: Callable[[TypicalSizes], Sequence[PlausibleTerm]] = lambda _sizes: ()
    """Sizes in which it may be there without having been identified."""
    rank: int = 100
    """Where two are worth the same, the lower rank is asked for first: the more common on machines."""

    @property
    def name(self) -> str:
        """The effect's name: hil_sim's file, the section of the plant file, the word in a verdict."""
        return section_of(self.physics)

    @property
    def bounds(self) -> dict[str, Quantity]:
        """By parameter of the plant's effect: unit, and what a plant takes."""
        return {parameter.name: parameter.quantity for parameter in fields_of(self.physics.Params)}

    def written_as(self, found: IdentifiedTerms) -> str:
        """The section of a plant file that holds what was found."""
        return self.name if self.plant_effect is None else self.plant_effect(found)

    def family(self, channel: ResidualChannel) -> TermFamily | None:
        """The candidate terms in a residual channel."""
        return next((family for family in self.terms if family.channel is channel), None)

    def possible(self, coefficients: Array) -> bool:
        """Whether nature has such coefficients."""
        return self.physical is None or bool(self.physical[0] < coefficients[0] < self.physical[1])

    def parameters(self, shape_parameters: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
        """What shape parameters and coefficients mean, SI; columns beyond those declared have no meaning."""
        if self.parameters_of is not None:
            return self.parameters_of(shape_parameters, coefficients)
        by_coefficient = zip(self.coefficients.items(), self.sign * coefficients, strict=False)
        by_shape = zip(self.shape_parameters.items(), shape_parameters, strict=False)
        return {name: SiParameter(float(value), unit) for (name, unit), value in (*by_coefficient, *by_shape)}

    def model_terms(self, of: ModelEffect) -> Sequence[ModelTerm]:
        """The terms that the plant's effect is."""
        if self.from_plant is not None:
            return self.from_plant(of)
        shape_parameters = tuple(getattr(of.params, name) for name in self.shape_parameters)
        coefficients = tuple(self.sign * getattr(of.params, name) for name in self.coefficients)
        channel = self.terms[0].channel if self.terms else ResidualChannel.FORCE
        return [ModelTerm(self.name, shape_parameters, coefficients, channel)]
