"""The thresholds of selection; calibrated on training seeds of the blind trials (docs/blind-trials.md)."""

from typing import NamedTuple


class SelectionRules(NamedTuple):
    """When a term is selected. Gains and shares are of squares, cross-validated; see each."""

    least_gain: float = 0.01
    """Least share of the unexplained variance that a term explains."""
    least_initial_share: float = 0.002
    """Least share of the initial variance that a term explains: less is the misfit of a larger effect."""
    false_alarm: float = 0.01
    """Probability that the best of all candidates passes by chance."""
    least_set_gain: float = 0.1
    """Least share of the unexplained variance of each further term in a set that is judged as a whole."""
    least_refit_gain: float = 0.15
    """Least share of the variance that refitting removes where the nominal values are reported as wrong."""
    most_terms: int = 12
    """Terms in one channel."""
    least_unnamed_gain: float = 0.1
    """Least share of the unexplained variance that an unnamed term explains."""
    least_unnamed_initial_share: float = 0.02
    """Least share of the initial variance that an unnamed term explains."""
    most_unnamed_terms: int = 2
    """Unnamed terms in one channel."""
    negligible_force_share: float = 0.01
    """RMS of an effect over that of the measured force, below which the effect is negligible."""
