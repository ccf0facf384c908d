"""Repeats one run, and prints its log."""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.commands.stage import Stage
from tests.campaigns.campaign.worker import run_seed

if TYPE_CHECKING:
    from rich.console import Console

    from tests.campaigns.campaign.run import Evidence

FRAMES_BEFORE, FRAMES_AFTER = 12, 60


def show(seed: int, console: Console) -> int:
    """Make the run and print its log; return the exit status."""
    evidence, judgement = run_seed(seed)
    plan, injected = evidence.plan, evidence.injected
    console.print(f"seed {seed}: {plan.fault.name} while {plan.state}, {plan.pacing}, ", end="")
    console.print("standing by" if plan.stand_by else "not standing by")
    if plan.second is not None and evidence.second is not None:
        second = evidence.second
        console.print(f"then {plan.second.name} in cycle {second.injected.cycle}, axis {'xy'[second.axis]}")
    console.print(f"axis {'xy'[evidence.axis]}, node {evidence.node}")
    for cycle, stage in evidence.stages:
        console.print(f"  cycle {cycle:5d}  {Stage(stage).name.lower().replace('_', ' ')}")
    if injected is None:
        console.print("the state was not reached, so no fault was injected")
    else:
        place, cycle, time_s, stage = injected
        console.print(f"the fault came in cycle {cycle}, {time_s:.4f} s, in {stage.name.lower()}")
        _show_frames(evidence, place, console)
    for text in evidence.reported:
        console.print(f"  reported: {text}", markup=False)
    if evidence.report is not None:
        report = evidence.report
        console.print(f"report: {'failed' if report.failed else 'good'}, {report.reason}", markup=False)
    console.print(evidence.error or evidence.stuck, markup=False)
    if judgement.reaction is not None:
        console.print(f"reaction after {judgement.reaction.cycles} cycles of {judgement.reaction.bound}")
    for text in judgement.violations:
        console.print(f"  VIOLATION {text}", style="red", markup=False)
    return 1 if judgement.violations else 0


def _show_frames(evidence: Evidence, place: int, console: Console) -> None:
    """Print the frames around the fault."""
    first = max(0, place - FRAMES_BEFORE)
    for index, frame in enumerate(evidence.frames[first : place + FRAMES_AFTER], start=first):
        marker = ">" if index == place else " "
        lost = "" if frame.arrived else "  did not arrive so"
        console.print(
            f"{marker} {frame.cycle:5d} {frame.time_s:9.4f}  {frame.sender:10s} "
            f"{frame.can_id:03X} {frame.data.hex(' ')}{lost}",
            markup=False,
            highlight=False,
        )
