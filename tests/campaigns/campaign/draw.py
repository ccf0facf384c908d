"""What is drawn for a run from its number, before it begins."""

from __future__ import annotations

from functools import cache
from random import Random
from typing import TYPE_CHECKING, NamedTuple

from tests.campaigns.campaign import faults

if TYPE_CHECKING:
    from tests.campaigns.campaign.fault_context import Fault

TWO, AGAIN = 0.25, 0.15
"""Shares of the runs: with a second fault; followed by another run, where nothing is broken for good."""
SECONDS = frozenset(
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
"""May come behind another one: what does not put itself into the same place of the wire."""
LASTING = frozenset(
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
"""Somebody has to mend the table before another run."""


class Plan(NamedTuple):
    """What is drawn for a run before it begins."""

    seed: int
    fault: Fault
    state: str
    pacing: str
    stand_by: bool
    second: Fault | None = None
    """Comes some cycles behind the first, often while the machine is busy with that."""
    again: bool = False
    """Whether another run follows, as the page says that it goes on."""


@cache
def _pairs() -> list[tuple[Fault, str]]:
    return [(fault, state) for fault in faults.ALL for state in fault.states]


def draw(seed: int) -> Plan:
    """The plan of this number; all faults and states come round, chance does the rest."""
    rng, pairs = Random(seed), _pairs()
    fault, state = pairs[seed % len(pairs)] if rng.random() < 0.5 else rng.choice(pairs)
    stand_by = state not in {"booting", "starting", "running", "stopping"} or rng.random() < 0.6
    pacing = rng.choice(fault.pacings)
    second = _second(rng, fault, state, pacing) if rng.random() < TWO else None
    whole = not any(each is not None and each.name in LASTING for each in (fault, second))
    return Plan(seed, fault, state, pacing, stand_by, second, again=whole and rng.random() < AGAIN)


def _second(rng: Random, first: Fault, state: str, pacing: str) -> Fault | None:
    """Another one that may come in this state; not where the first has ended all, or is still booting."""
    if first.kills or state == "booting":
        return None
    able = [each for each in faults.ALL if each.name in SECONDS and pacing in each.pacings]
    return rng.choice([each for each in able if each is not first])
