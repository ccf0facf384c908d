"""Applies all oracles to the evidence of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from tests.campaigns.campaign import oracles_motion, oracles_reaction, oracles_results
from tests.campaigns.campaign.views import views

if TYPE_CHECKING:
    from servo_ctrl.config.model import MachineConfig
    from tests.campaigns.campaign.oracles_reaction import Reaction
    from tests.campaigns.campaign.run import Evidence

ORACLES = (
    oracles_reaction.no_reaction,
    oracles_motion.within_limits,
    oracles_motion.at_rest,
    oracles_motion.axes_stop_together,
    oracles_motion.no_operation_in_standby,
    oracles_results.ended_as_intended,
    oracles_results.recording_complete,
    oracles_results.next_run_succeeds,
)


class Judgement(NamedTuple):
    """The violations of a run, and its reaction."""

    violations: tuple[str, ...]
    reaction: Reaction | None


def judge(evidence: Evidence, machine: MachineConfig) -> Judgement:
    """Apply all oracles: to each fault by itself, and to the effects that both together may have."""
    first, second, both = views(evidence)
    seen, violations = (None, []) if first is None else oracles_reaction.reaction(first)
    if second is not None:
        violations += [f"second fault: {text}" for text in oracles_reaction.reaction(second)[1]]
    for oracle in ORACLES:
        violations += [f"{oracle.__name__}: {text}" for text in oracle(both)]
    for view in (first, second):
        violations += [
            f"reported: {text}" for text in (oracles_results.reported(view) if view is not None else ())
        ]
    violations += oracles_results.learned(both, machine)
    return Judgement(tuple(violations), seen)
