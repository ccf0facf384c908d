"""Assume each effect of the catalogue at a size that is typical of machines.

The sizes are shares of the axis' own Coulomb friction, peak force and travel, or the middle of the
catalogue's range. They say which effects are worth looking for, not which ones exist.
"""

from reconcile.catalogue.entry import TypicalSizes
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.registry import ENTRIES
from reconcile.design.model_discrimination import AssumedTerm
from reconcile.design.recorded_axis import RecordedAxis

LARGE_SHARE, SMALL_SHARE = 0.2, 0.1
"""Of the Coulomb friction: typical of another friction, and of a ripple."""
BY_RANK = sorted(ENTRIES.values(), key=lambda entry: entry.rank)


def plausible_terms(recorded: RecordedAxis, channel: ResidualChannel) -> list[AssumedTerm]:
    """Return the assumed terms of a channel, with coefficients in N and m."""
    sizes = _typical_sizes(recorded)
    return [
        AssumedTerm((entry.name, term.shape_parameters), term.coefficients)
        for entry in BY_RANK
        if entry.family(channel)
        for term in entry.plausible(sizes)
    ]


def _typical_sizes(recorded: RecordedAxis) -> TypicalSizes:
    coulomb_n = max(recorded.coulomb_n, 1e-3)
    fastest_m_s = max(recorded.max_velocity_m_s, 1e-6)
    middle_m, half_m = (
        0.5 * (recorded.min_position_m + recorded.max_position_m),
        0.5 * (recorded.max_position_m - recorded.min_position_m),
    )
    return TypicalSizes(
        coulomb_n=coulomb_n,
        large_n=LARGE_SHARE * coulomb_n,
        small_n=SMALL_SHARE * coulomb_n,
        peak_n=recorded.mass_kg * recorded.max_acceleration_m_s2
        + coulomb_n
        + recorded.viscous_n_s_m * fastest_m_s,
        fastest_m_s=fastest_m_s,
        over_travel=(2.0, middle_m, max(half_m, 1e-6)),
    )
