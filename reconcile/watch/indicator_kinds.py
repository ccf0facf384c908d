"""The indicators of each residual channel: of the rigid model, and of effects of the catalogue."""

from reconcile.catalogue.entry import IndicatorKind
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.registry import ENTRIES

RIGID_MODEL = (
    IndicatorKind(name="mass_kg", unit="kg", words="moved mass", beside=True),
    IndicatorKind(name="viscous_n_s_m", unit="N s/m", words="viscous friction", beside=True),
    IndicatorKind(name="coulomb_n", unit="N", words="Coulomb friction", beside=True),
)
"""Coefficients of the rigid model."""


def _of_effects(channel: ResidualChannel) -> tuple[IndicatorKind, ...]:
    """Return the catalogue's indicators: first those that are fitted together, then by rank."""
    entries = sorted((e for e in ENTRIES.values() if e.family(channel)), key=lambda entry: entry.rank)
    found = [indicator._replace(effect=entry.name) for entry in entries for indicator in entry.indicators]
    return tuple(sorted(found, key=lambda indicator: not indicator.beside))


INDICATORS = {
    ResidualChannel.FORCE: RIGID_MODEL + _of_effects(ResidualChannel.FORCE),
    ResidualChannel.POSITION_DEVIATION: _of_effects(ResidualChannel.POSITION_DEVIATION),
}
RESIDUAL_LEVEL = "residual"
"""Name of the residual level: the natural logarithm of the residual's RMS in N or m."""
RESIDUAL_WORDS = {
    ResidualChannel.FORCE: "force that nothing explains",
    ResidualChannel.POSITION_DEVIATION: "deviation that nothing explains",
}
