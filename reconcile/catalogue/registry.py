"""Finds the entries of the catalogue: the modules of this package that have the name of an effect."""

import pkgutil
from collections.abc import Mapping, Sequence
from importlib import import_module

from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import EFFECTS
from kernels.arrays import Array
from kernels.quantities import section_of
from reconcile import catalogue
from reconcile.catalogue.entry import CatalogueEntry, Interval, Rival
from reconcile.catalogue.kinds import RegressionData, ResidualChannel, TermFamily

FORM = {ResidualChannel.FORCE: 0.08, ResidualChannel.POSITION_DEVIATION: 0.01}
"""Systematic error of a coefficient by laws of another form, as a share of it: docs/blind-trials.md."""


def _all_entries() -> dict[str, CatalogueEntry]:
    files = {info.name for info in pkgutil.iter_modules(catalogue.__path__)}
    effects = sorted(files & {section_of(module) for module in EFFECTS})
    return {name: import_module(f"{catalogue.__name__}.{name}").ENTRY for name in effects}


CATALOGUE = _all_entries()
"""Every entry by its effect's name."""
ENTRIES = {name: entry for name, entry in CATALOGUE.items() if entry.terms}
"""Entries with terms, which can be identified."""
TIMING = frozenset(name for name, entry in ENTRIES.items() if entry.timing)
ADDITIVE = frozenset(name for name, entry in ENTRIES.items() if entry.additive)
IMITATED_BY_PRESLIDING = frozenset(name for name, entry in ENTRIES.items() if entry.presliding_can_imitate)
SHOWS_AFTER_PRESLIDING = frozenset(name for name, entry in ENTRIES.items() if entry.shows_after_presliding)
DRIFTING_COLUMNS = {name: entry.drifting_columns for name, entry in ENTRIES.items() if entry.drifting_columns}
"""See the entry's fields of these names."""
LAW_OF_CURVE = {entry.curve_over: name for name, entry in ENTRIES.items() if entry.curve_over}
"""By coordinate of a smooth term in the force: the law that any curve over it is."""
LAW_NEAR_CURVE = {entry.curve_near: name for name, entry in ENTRIES.items() if entry.curve_near}
"""By coordinate: the law that a curve over it is if the law's own terms explain nearly as much."""
_FRICTION_KINDS = {kind for kind in Kind if kind.name.startswith(("FRICTION", "DAMPING", "PRESLIDING"))}
FRICTION = frozenset(name for name, entry in ENTRIES.items() if entry.physics.KIND in _FRICTION_KINDS)
"""Effects of friction, which are not a load on the drive train."""


def family(effect: str, channel: ResidualChannel) -> TermFamily | None:
    """Return the candidate terms of an effect in a residual channel; None if there are none."""
    return ENTRIES[effect].family(channel) if effect in ENTRIES else None


def has_levels(effect: str, width: int) -> bool:
    """Return whether a term with `width` columns has levels of each recording beside its drift."""
    return 0 < DRIFTING_COLUMNS.get(effect, 0) < width


def possible(effect: str, coefficients: Array) -> bool:
    """Return whether the coefficients are physically possible; those of an unnamed term always are."""
    return effect not in CATALOGUE or CATALOGUE[effect].possible(coefficients)


def systematic(effect: str, parameter: str, channel: ResidualChannel) -> tuple[float, float]:
    """Return the systematic errors below and above a parameter's value, as shares of it."""
    own = CATALOGUE[effect].systematic if effect in CATALOGUE else {}
    return own.get(parameter, (FORM[channel], FORM[channel]))


def declared_intervals(
    effect: str,
    values: Mapping[str, float],
    resampled: Mapping[str, Interval],
    datasets: Sequence[RegressionData],
) -> dict[str, Interval]:
    """Return the 95 % intervals that an effect's entry declares itself; empty if it declares none."""
    return CATALOGUE[effect].intervals(values, resampled, datasets) if effect in CATALOGUE else {}


def confused_with(effect: str) -> list[str]:
    """Return the effects with which one is confused, by its own entry, then by those of others."""
    own = [rival.effect for rival in CATALOGUE[effect].rivals] if effect in CATALOGUE else []
    others = [name for name, entry in CATALOGUE.items() if effect in {rival.effect for rival in entry.rivals}]
    return [*dict.fromkeys([*own, *others])]


def distinguishing_observation(one: str, other: str) -> str:
    """Return the observation that distinguishes two effects; empty if neither entry declares one."""
    words = [rival.distinguished_by for rival in _between(one, other)]
    words += [CATALOGUE[name].shown_by for name in (one, other) if name in CATALOGUE]
    return next((text for text in words if text), "")


def experiment_by_hand(one: str, other: str) -> str:
    """Return the manual experiment that distinguishes two effects; empty if a motion does."""
    return next((rival.experiment for rival in _between(one, other) if rival.experiment), "")


def _between(one: str, other: str) -> list[Rival]:
    """Return what the entry of either declares of the other."""
    pairs = [(name, rival) for name, rival in ((one, other), (other, one)) if name in CATALOGUE]
    return [rival for name, other in pairs for rival in CATALOGUE[name].rivals if rival.effect == other]
