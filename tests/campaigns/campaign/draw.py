"""Draws the plan of a run from its seed."""

from __future__ import annotations

from functools import cache
from random import Random
from typing import TYPE_CHECKING, NamedTuple

from tests.campaigns.campaign import faults

if TYPE_CHECKING:
    from tests.campaigns.campaign.fault_context import Fault

SECOND_FAULT_SHARE, NEXT_RUN_SHARE = 0.25, 0.15
"""Shares of the runs with a second fault, and of those that another run follows; chosen."""
SECOND_FAULTS = frozenset(
    {
        "another controller",
        "axis runs away",
        "broken scale",
        "brown-out of a drive",
        "bus warning",
        "clock step",
        "controller killed",
        "death of a node",
        "disk full",
        "drive fault",
        "emergency message",
        "foreign frames",
        "frames lost on the bus",
        "interface fails",
        "jammed axis",
        "limit switch",
        "node restarts",
        "object of a node changed",
        "quick stop",
        "simulator killed",
        "slipped coupling",
        "stop signal",
        "switched off",
        "task cancelled",
        "tick too late",
        "ticks missed briefly",
    }
)
"""Faults that may follow another one, because they do not replace the same function of the wire."""
PERMANENT_FAULTS = frozenset(
    {
        "axis runs away",
        "broken scale",
        "death of a node",
        "jammed axis",
        "limit switch",
        "mute node",
        "simulator killed",
        "simulator killed while booting",
        "slipped coupling",
    }
)
"""Faults after which the table must be repaired before another run."""


class Plan(NamedTuple):
    """The plan of a run."""

    seed: int
    fault: Fault
    state: str
    pacing: str
    stand_by: bool
    second: Fault | None = None
    """A second fault some cycles after the first, often during the reaction to it."""
    next_run: bool = False
    """Whether another run follows, which the page promises to be possible."""


@cache
def _pairs() -> list[tuple[Fault, str]]:
    return [(fault, state) for fault in faults.ALL for state in fault.states]


def draw(seed: int) -> Plan:
    """Return the plan of this seed; half of the seeds take the pairs of fault and state in turn."""
    rng, pairs = Random(seed), _pairs()
    fault, state = pairs[seed % len(pairs)] if rng.random() < 0.5 else rng.choice(pairs)
    stand_by = state not in {"booting", "starting", "running", "stopping"} or rng.random() < 0.6
    pacing = rng.choice(fault.pacings)
    second = _second_fault(rng, fault, state, pacing) if rng.random() < SECOND_FAULT_SHARE else None
    repairable = not any(each is not None and each.name in PERMANENT_FAULTS for each in (fault, second))
    return Plan(
        seed, fault, state, pacing, stand_by, second, next_run=repairable and rng.random() < NEXT_RUN_SHARE
    )


def _second_fault(rng: Random, first: Fault, state: str, pacing: str) -> Fault | None:
    """Return a second fault that is possible in this state; None after a fatal one and while booting."""
    if first.kills or state == "booting":
        return None
    possible = [each for each in faults.ALL if each.name in SECOND_FAULTS and pacing in each.pacings]
    return rng.choice([each for each in possible if each is not first])
