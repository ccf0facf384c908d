"""When a hypothesis is believed: it matters, beyond chance, is possible, and is no shadow of presliding."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from reconcile.catalogue.registry import possible
from reconcile.catalogue.temperature_dependent_friction import DRIFT, DRIFTING, own_levels

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from reconcile.evidence import Rules, Score, Trial
    from reconcile.ledger import Candidate

    Array = NDArray[np.float64]

BETTER = 2.0
"""Standard errors by which another effect must be better to take the place of one."""
SHADOWED = (
    "stribeck_friction",
    "amplifier_dead_zone",
    "dwell_dependent_breakaway",
    "temperature_dependent_friction",
    "torque_constant_saturation",
)
"""Effects that can pass for the rest of a presliding that has another curve than its hypothesis."""

SETTLED = ("stribeck_friction", "amplifier_dead_zone", "temperature_dependent_friction")
"""Those of them that must show where presliding is over, too. The strongest force is just after a start."""
SETTLED_WAYS = 10.0
"""Of the longest presliding that was found."""


class Search(NamedTuple):
    """What every step of a selection needs."""

    trial: Trial
    rules: Rules
    named: list[Candidate]
    start: float
    """Sum of squares that there was at the beginning."""
    shadow: list[Candidate]
    """Whatever changes with the way since the reversal: what lives there only is presliding."""


def believed(search: Search, chosen: Sequence[Candidate], score: Score, before: Array) -> bool:
    """Whether a hypothesis is worth it, beyond chance, physically possible, and no shadow of presliding."""
    c, rules = score.candidate, search.rules
    share = float(before.sum() - score.squares.sum()) / max(search.start, 1e-300)
    count = len(search.named)
    if any(other.effect == c.effect for other in chosen):  # one more of a kind: among its kind alone
        count = sum(other.effect == c.effect for other in search.named)
    if (
        not score.beyond_chance(count, rules.false_alarm)
        or score.gain < rules.least_gain
        or share < rules.least_share
    ):
        return False
    trial = search.trial
    if not possible(c.effect, trial.coefficients([*chosen, c])[-len(c.columns) :]):
        return False
    if c.effect == DRIFT and not _drifts(search, chosen, c):
        return False
    if c.effect in SHADOWED and search.shadow:
        beside = [*chosen, *search.shadow]
        unseen = trial.unseen(beside)
        own = [trial.score(beside, unseen, c)]
        if c.effect in SETTLED:
            ways_m = [c.shape[0] for c in chosen if c.effect == "presliding_hysteresis"]
            among = trial.way_m > SETTLED_WAYS * max(ways_m, default=0.0)
            own.append(trial.compare([*beside, c], unseen, among=among))
        return all(_matters(score, rules) for score in own)
    return True


def _drifts(search: Search, chosen: Sequence[Candidate], c: Candidate) -> bool:
    """Whether friction changes in the recordings, and is not only another one in each."""
    whole = (o for o in search.named if o.effect == DRIFT and own_levels(o.shape))
    levels = next((o._replace(columns=o.columns[DRIFTING:]) for o in whole), None)
    if levels is None:
        return True
    beside = [*chosen, levels]
    drift = c._replace(columns=c.columns[:DRIFTING])
    return _matters(search.trial.score(beside, search.trial.unseen(beside), drift), search.rules)


def _matters(score: Score, rules: Rules) -> bool:
    return max(score.t, score.summed) >= BETTER and score.gain >= rules.least_gain
