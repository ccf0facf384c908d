"""Level of friction over temperature, learned from production, by which the level in use is scheduled.

The table has nodes every `STEP_K`, linear between them and constant beyond; no form is assumed. A reversal at
temperature T that measures the level m corrects the nodes beside T by shares of e = ln m - ln table(T):

    ln l_i += k_i e,    k_i = s_i v_i / (1 + s_1^2 v_1 + s_2^2 v_2),    v_i -= k_i s_i v_i,  then v_i /= L

with hat functions s and variances v relative to that of one measurement: recursive least squares with
forgetting L (Ljung 1999, section 11.2) whose covariance is kept diagonal. Where friction departs by more than
`JUMP` from what is known, something else has changed: all nodes move.

Between reversals the level in use follows the *ratio* of the table, by `RATE_1_S` at most, so that a
sensor that sticks changes nothing. The table acts once it has predicted better than a constant level:

    E = F E + c^2 - (c - d)^2

c is the measured and d the predicted change of ln level from reversal to reversal; it acts above `EVIDENCE`.
"""

import bisect
import math
from typing import NamedTuple

from servo_ctrl.learning.temperature_input import RANGE_DEGC

STEP_K = 5.0
"""Distance of nodes; chosen: lubricants halve their viscosity in 10 to 20 K."""
FORGETTING = 0.95
"""L: the last twenty reversals at a node count; chosen."""
VARIANCE_NEW = 10.0
"""Variance of a new node relative to that of one measurement; chosen: the first measurement counts most."""
JUMP = math.log(1.25)
"""Departure from known nodes that temperature does not explain; chosen."""
KNOWN_BELOW = 1.0
"""Variance below which a node is known; chosen: as good as one measurement."""
EVIDENCE = 0.003
"""E above which the table acts; chosen: as one change of 5 % that came as predicted."""
EVIDENCE_MAX = 0.05
"""Bound of E, so that a sensor that has failed is soon found out; chosen."""
EVIDENCE_FORGETTING = 0.995
"""F; chosen: a warm-up has some hundred reversals."""
CHANGE_MAX = 0.2
"""Bound of |c| and |d|: one reversal alone convinces of nothing; chosen."""
RATE_1_S = 0.02
"""Largest relative change of the level in use, per second; chosen: far above that of a warm-up."""
FOLLOW_MIN = 0.005
"""Change of ln level below which it stands still; chosen: less than reversals scatter."""


class LevelNode(NamedTuple):
    """One node of the table."""

    temperature_degc: float
    level: float
    """Friction relative to the strokes' result."""
    variance: float
    """v, relative to the variance of one measurement."""


class LevelSchedule(NamedTuple):
    """What is known of friction over temperature, and how far the level in use has followed it."""

    nodes: tuple[LevelNode, ...] = ()
    """Rising by temperature."""
    followed: float = math.nan
    """Level of the table up to which the level in use has followed; NaN before the first reversal."""
    moved: float = 0.0
    """Change of ln level by the table since the last reversal."""
    evidence: float = 0.0
    """E."""

    @property
    def acts(self) -> bool:
        """Whether the level in use follows the table."""
        return self.evidence > EVIDENCE


def level_at(nodes: tuple[LevelNode, ...], temperature_degc: float) -> float:
    """Level of the table; NaN without nodes or temperature."""
    if not nodes or math.isnan(temperature_degc):
        return math.nan
    upper = bisect.bisect(nodes, temperature_degc, key=lambda node: node.temperature_degc)
    if upper in {0, len(nodes)}:
        return nodes[min(upper, len(nodes) - 1)].level
    low, high = nodes[upper - 1], nodes[upper]
    share = (temperature_degc - low.temperature_degc) / (high.temperature_degc - low.temperature_degc)
    return math.exp((1.0 - share) * math.log(low.level) + share * math.log(high.level))


def learned_at(
    schedule: LevelSchedule, temperature_degc: float, level: float, growth: float
) -> LevelSchedule:
    """Schedule after a reversal at a temperature that found the level in use too low by the share `growth`.

    Values outside of `RANGE_DEGC`, NaN, or a level that is not positive change nothing.
    """
    measured = level * (1.0 + growth)
    if not (RANGE_DEGC[0] <= temperature_degc < RANGE_DEGC[1] and 0.0 < measured < math.inf):
        return schedule
    evidence, known = schedule.evidence, level_at(schedule.nodes, temperature_degc)
    if not math.isnan(schedule.followed):
        change = _bounded(math.log1p(growth) + schedule.moved)
        predicted = _bounded(math.log(known / schedule.followed) + schedule.moved)
        evidence = EVIDENCE_FORGETTING * evidence + predicted * (2.0 * change - predicted)
    nodes = _corrected(schedule.nodes, temperature_degc, measured)
    return LevelSchedule(
        nodes, level_at(nodes, temperature_degc), evidence=min(max(evidence, -EVIDENCE), EVIDENCE_MAX)
    )


def followed(
    schedule: LevelSchedule, temperature_degc: float, elapsed_s: float
) -> tuple[LevelSchedule, float]:
    """Schedule after `elapsed_s` at a temperature, and the factor on the level in use.

    The factor is 1 while the schedule stands still: it does not act, there is no temperature (NaN), or the
    table has changed by less than `FOLLOW_MIN`.
    """
    wanted = level_at(schedule.nodes, temperature_degc) / schedule.followed
    if not schedule.acts or not 0.0 < wanted < math.inf or abs(math.log(wanted)) < FOLLOW_MIN:
        return schedule, 1.0
    bound = RATE_1_S * elapsed_s
    step = min(max(math.log(wanted), -bound), bound)
    factor = math.exp(step)
    return schedule._replace(followed=schedule.followed * factor, moved=schedule.moved + step), factor


def relative_to(schedule: LevelSchedule, level: float) -> LevelSchedule:
    """Schedule with all levels relative to `level`."""
    nodes = tuple(node._replace(level=node.level / level) for node in schedule.nodes)
    return schedule._replace(nodes=nodes, followed=schedule.followed / level)


def _bounded(change: float) -> float:
    return min(max(change, -CHANGE_MAX), CHANGE_MAX)


def _corrected(
    nodes: tuple[LevelNode, ...], temperature_degc: float, measured: float
) -> tuple[LevelNode, ...]:
    """Nodes after a measurement; those beside the temperature are added if they are missing."""
    low_degc = math.floor(temperature_degc / STEP_K) * STEP_K
    place = (temperature_degc - low_degc) / STEP_K
    table = {node.temperature_degc: node for node in nodes}
    shares = {low_degc: 1.0 - place, low_degc + STEP_K: place}
    beside = {
        at: table.get(at, LevelNode(at, level_at(nodes, at) if nodes else measured, VARIANCE_NEW))
        for at in shares
    }
    expected = math.prod(beside[at].level ** share for at, share in shares.items())
    error = math.log(measured / expected)
    is_known = all(beside[at].variance < KNOWN_BELOW for at, share in shares.items() if share > 0.0)
    if is_known and abs(error) > JUMP:
        return tuple(node._replace(level=node.level * math.exp(error)) for node in nodes)
    total = 1.0 + sum(share**2 * beside[at].variance for at, share in shares.items())
    for at, share in shares.items():
        node = beside[at]
        gain = share * node.variance / total
        variance = min(node.variance * (1.0 - gain * share) / FORGETTING**share, VARIANCE_NEW)
        table[at] = LevelNode(at, node.level * math.exp(gain * error), variance)
    return tuple(table[at] for at in sorted(table))
