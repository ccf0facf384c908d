"""All oracles over the evidence of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from tests.campaigns.campaign import oracles_books, oracles_motion, oracles_reaction
from tests.campaigns.campaign.views import views

if TYPE_CHECKING:
    from servo_ctrl.config.model import MachineConfig
    from tests.campaigns.campaign.oracles_reaction import Reaction
    from tests.campaigns.campaign.run import Evidence

PLAIN = (
    oracles_reaction.goes_on,
    oracles_motion.within_limits,
    oracles_motion.at_rest,
    oracles_motion.together,
    oracles_motion.unasked,
    oracles_books.over,
    oracles_books.recorded,
    oracles_books.goes_on_again,
)


class Judgement(NamedTuple):
    """What a run has shown."""

    violations: tuple[str, ...]
    reaction: Reaction | None


def judge(evidence: Evidence, machine: MachineConfig) -> Judgement:
    """Ask all of them; of two faults each for its own, and what may come of them for both."""
    first, second, both = views(evidence)
    seen, violations = (None, []) if first is None else oracles_reaction.reaction(first)
    if second is not None:
        violations += [f"second fault: {text}" for text in oracles_reaction.reaction(second)[1]]
    for oracle in PLAIN:
        violations += [f"{oracle.__name__}: {text}" for text in oracle(both)]
    for view in (first, second):
        violations += [f"noted: {text}" for text in (oracles_books.noted(view) if view is not None else ())]
    violations += oracles_books.learned(both, machine)
    return Judgement(tuple(violations), seen)
