"""All oracles over the evidence of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from tests.campaign import oracles_books, oracles_motion, oracles_reaction

if TYPE_CHECKING:
    from servo_ctrl.config.model import MachineConfig
    from tests.campaign.oracles_reaction import Reaction
    from tests.campaign.run import Evidence

PLAIN = (
    oracles_reaction.goes_on,
    oracles_motion.within_limits,
    oracles_motion.at_rest,
    oracles_motion.together,
    oracles_motion.unasked,
    oracles_books.over,
    oracles_books.noted,
    oracles_books.recorded,
)


class Judgement(NamedTuple):
    """What a run has shown."""

    violations: tuple[str, ...]
    reaction: Reaction | None


def judge(evidence: Evidence, machine: MachineConfig) -> Judgement:
    """Ask all of them."""
    seen, violations = oracles_reaction.reaction(evidence)
    for oracle in PLAIN:
        violations += [f"{oracle.__name__}: {text}" for text in oracle(evidence)]
    violations += oracles_books.learned(evidence, machine)
    return Judgement(tuple(violations), seen)
