"""The declaration of an effect in the catalogue: all that the rooms of reconcile know of it, in one place.

Each module of this package that describes an effect ends with `ENTRY = CatalogueEntry(...)`. The registry
finds them; no table elsewhere names an effect.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import ModuleType
from typing import NamedTuple

from kernels.arrays import Array
from kernels.quantities import Quantity, fields_of, section_of
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm, PlantValues
from reconcile.catalogue.kinds import Parameter, ResidualChannel, ShapeParameters, TermFamily


class Rival(NamedTuple):
    """Another effect for which this one is often mistaken."""

    effect: str
    told_apart_by: str = ""
    """What tells them apart, in words; empty where the rival's own entry says it."""
    experiment: str = ""
    """The experiment by hand that it takes, by name; empty where a motion does."""


class TypicalSizes(NamedTuple):
    """What an axis has of friction, force and travel: the measure of what may be there unseen. SI."""

    coulomb_n: float
    large_n: float
    """What a friction may well be."""
    small_n: float
    """What a ripple may well be."""
    peak_n: float
    fastest_m_s: float
    over_travel: ShapeParameters
    """A parabola over the travel, as `polynomial` has it."""


class UnseenTerm(NamedTuple):
    """A term of a size that machines have."""

    shape: ShapeParameters
    coefficients: tuple[float, ...]


class IndicatorKind(NamedTuple):
    """What the watch of a machine measures with a term of fixed shape."""

    name: str
    unit: str
    words: str
    shape: ShapeParameters = ()
    factor: float = 1.0
    """The indicator is the coefficient times this."""
    beside: bool = False
    """Fitted beside the others; else after them, so that it widens nobody's error."""
    effect: str = ""
    """Filled in from the entry; empty for a coefficient of the rigid model."""


def _as_identified(found: IdentifiedTerms, _notes: list[str]) -> PlantValues:
    """The parameters of the first term under their own names."""
    return dict(found.terms[0])


def _no_parameters(_shape: ShapeParameters, _coefficients: Array) -> dict[str, Parameter]:
    return {}


def _any_coefficients(_coefficients: Array) -> bool:
    return True


def _no_sentence(_parameters: dict[str, float]) -> str:
    return ""


def _no_terms(_of: ModelEffect) -> list[ModelTerm]:
    return []


def _nothing_unseen(_sizes: TypicalSizes) -> list[UnseenTerm]:
    return []


@dataclass(frozen=True, kw_only=True)
class CatalogueEntry:
    """One effect of hil_sim, as the engine looks for it, names it, reports it and writes it into a model.

    An entry without `terms` cannot be identified by itself; it says what the plant's effect looks like
    (`from_plant`) and what it is confused with.
    """

    physics: ModuleType
    """hil_sim's module: name, law, units and bounds."""

    # what the regression tries
    terms: tuple[TermFamily, ...] = ()
    """At most one family a residual channel."""
    parameters: Callable[[ShapeParameters, Array], dict[str, Parameter]] = _no_parameters
    """What shape and coefficients mean, SI."""
    possible: Callable[[Array], bool] = _any_coefficients
    """Whether nature has such coefficients."""
    additive: bool = False
    """A sum of terms with different shapes; of other effects one shape is the best."""
    continuous_shape_numbers: int = 0
    """The first numbers of a shape that may take any value, and are refined; 0: the shapes are a list."""
    drifting_columns: int = 0
    """Columns that change within a recording; those after them are levels of each recording. 0: no levels."""
    timing: bool = False
    """A shift in time: below one sample it is how the channels were sampled, and no physics."""
    presliding_can_imitate: bool = False
    """It can pass for the residual of a presliding that follows another curve than its term."""
    shows_after_presliding: bool = False
    """Of these: it must also show where presliding is over."""
    ends_with_reversal: bool = False
    """The first number of a shape is a travel; below what the filters resolve of a reversal it is a step."""

    # what is reported
    sentence: Callable[[dict[str, float]], str] = _no_sentence
    """What an engineer can check."""
    systematic: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """By parameter: shares of its value by which the truth may lie below and above it, beside the scatter."""
    equivalent: tuple[str, ...] = ()
    """Effects that these sensors cannot tell from it."""
    on_every_axis: bool = False
    """Every axis has some of it: a rarer effect of half its size is reported first."""
    mean_of: str = ""
    """It is the mean of that effect, whose zero nobody knows: reported after it."""
    indicators: tuple[IndicatorKind, ...] = ()

    # the plant
    to_plant: Callable[[IdentifiedTerms, list[str]], PlantValues] = _as_identified
    """Parameters of the plant's effect; may raise NotInAPlant, and notes what is not as it was found."""
    from_plant: Callable[[ModelEffect], Sequence[ModelTerm]] = _no_terms
    """The terms that the plant's effect is."""
    fixed_to_screw: bool = False
    """Its phase is fixed to the screw: a recording whose zero is shifted within a turn shows it."""

    # the next experiment
    rivals: tuple[Rival, ...] = ()
    """In the order in which they are doubted."""
    shown_by: str = ""
    """What shows it, whatever the rival."""
    experiment: str = ""
    """The experiment by hand without which it hardly shows, by name; empty where a motion shows it."""
    unseen: Callable[[TypicalSizes], Sequence[UnseenTerm]] = _nothing_unseen
    """Sizes in which it may be there although nobody has seen it."""
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

    def by_recording(self, channel: ResidualChannel) -> bool:
        """Whether its coefficients may be the recording's own."""
        family = self.family(channel)
        return family is not None and any(family.per_recording)

    def family(self, channel: ResidualChannel) -> TermFamily | None:
        """The candidate terms in a residual channel."""
        return next((family for family in self.terms if family.channel is channel), None)
