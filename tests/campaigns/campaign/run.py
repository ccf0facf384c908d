"""A run by its number: what is drawn, how it goes, and what is left of it as evidence."""

from __future__ import annotations

import logging
import shutil
from functools import partial
from random import Random
from typing import TYPE_CHECKING, Any, NamedTuple

from servo_ctrl.commands.stage import Stage
from tests.campaigns.campaign import life
from tests.campaigns.campaign.fault_context import MOVING, FaultContext
from tests.campaigns.campaign.machine import parsed_files_kept
from tests.campaigns.campaign.script import Operator
from tests.campaigns.campaign.stand import Stand

if TYPE_CHECKING:
    from pathlib import Path

    from servo_ctrl.daemon.run.report import RunReport
    from tests.campaigns.campaign.draw import Plan
    from tests.campaigns.campaign.fault_context import Fault
    from tests.campaigns.campaign.machine import CampaignMachine
    from tests.campaigns.campaign.truth import Truth
    from tests.campaigns.campaign.wire import Frame

AFTERLIFE_S = 0.5
COASTING = 12
"""So many times as long at most, for an axis that nothing brakes but its friction."""
BOOT_FRAMES = 300
PAUSES = (0, 1, 2, 5, 20, 60, 150)
"""Ticks between two faults."""
SILENCING = frozenset({"death of a node", "mute node", "node silent"})
"""After these another fault of the same node does not show: it goes to the other axis."""


Instant = tuple[int, int, float, Stage]
"""Place among the frames, cycle, time (s) and the daemon's stage."""


class Second(NamedTuple):
    """The second fault as it came."""

    happened: Instant
    axis: int
    node: int
    notes: dict[str, Any]


class Evidence(NamedTuple):
    """What is known of a run when it is over. Cycles are those of the wire, counted by SYNCs."""

    plan: Plan
    folder: Path
    truth: Truth
    frames: list[Frame]
    happened: Instant | None
    """When the fault came; None: it did not."""
    stages: list[tuple[int, int]]
    report: RunReport | None
    noted: tuple[str, ...]
    """Events of the daemon, also of one that was killed."""
    error: str
    """Of the exception that ended the run, with its kind; "" when there was none."""
    stuck: str
    ticks: int
    axis: int
    node: int
    frames_before_stop: int | None = None
    """Place among the frames when the operator wanted the run to end."""
    killed_ticks: int = 0
    """Ticks before the controller was killed."""
    killed_cycle: int | None = None
    """Cycle in which it was killed."""
    notes: tuple[tuple[str, Any], ...] = ()
    """What the fault wanted to be remembered."""
    second: Second | None = None
    again: str = ""
    """What was wrong with the run that followed."""


def run(plan: Plan, machine: CampaignMachine, folder: Path) -> Evidence:
    """Make the run in this folder, which is empty."""
    logging.disable()  # what the daemon has to tell is in its events
    try:
        with parsed_files_kept():
            return _run(plan, machine, folder)
    finally:
        logging.disable(logging.NOTSET)


class _Injection:
    """Lets the faults of a plan happen, and keeps when they did."""

    def __init__(self, plan: Plan, stand: Stand, rng: Random) -> None:
        self.context, self.other = FaultContext(stand, rng), FaultContext(stand, rng)
        if plan.fault.name in SILENCING:
            self.other.take_axis(1 - self.context.axis)
        self.happened: Instant | None = None
        self.second: Second | None = None
        self._plan, self._stand, self._rng = plan, stand, rng

    def within_frames(self, fewest: int, most: int) -> None:
        """So many frames on, or at once."""
        wire = self._stand.wire
        wire.countdown, wire.on_zero = self._rng.randint(fewest, most), self._first
        if not wire.countdown:
            self._first()

    def another(self) -> None:
        """The second fault, where the first has happened and the stage is one for it."""
        fault, other, now = self._plan.second, self.other, self._now()
        if fault is not None and self.happened is not None and _able(fault, now[3]):
            self.second = Second(now, other.axis, other.node, other.notes)
            fault.inject(other)

    def undo(self) -> None:
        """What was exchanged is put back, the last thing first; a fault that has not come never will."""
        self._stand.wire.countdown = 0
        for undo in reversed((*self.context.undo, *self.other.undo)):
            undo()

    def _first(self) -> None:
        self.happened = self._now()
        self._plan.fault.inject(self.context)

    def _now(self) -> Instant:
        stand = self._stand
        stage = Stage.BOOTING if stand.services is None else stand.daemon.stage
        return len(stand.wire.frames), stand.wire.cycle, stand.loop.time(), stage


def _able(fault: Fault, stage: Stage) -> bool:
    if stage is Stage.RUNNING:
        return not set(MOVING).isdisjoint(fault.states)
    return stage.name.lower() in fault.states


def _run(plan: Plan, machine: CampaignMachine, folder: Path) -> Evidence:
    rng = Random(plan.seed ^ 0x5EED)
    shutil.copytree(machine.learned, folder / "learned")
    stand = Stand(machine, folder, plan.pacing)
    stand.sdo_timeout_s = plan.fault.sdo_timeout_s
    faults = _Injection(plan, stand, rng)
    if plan.state == "booting":
        faults.within_frames(1, BOOT_FRAMES)
    happen = partial(faults.within_frames, 0, 8)
    operator = Operator(stand, rng, plan.state, happen, plan.fault.watched, stand_by=plan.stand_by)
    if plan.second is not None:
        operator.second, operator.pause = faults.another, rng.choice(PAUSES)
    try:
        ending = life.live(stand, life.first(plan, stand))
    finally:
        faults.undo()
    alive = len(stand.wire.frames)
    if not stand.wire.nodes_dead:
        stand.wire.nodes = stand.bench.handle
        stand.afterlife(AFTERLIFE_S)
        for _ in range(COASTING):
            if stand.witness.rests():
                break
            stand.afterlife(AFTERLIFE_S)
    evidence = Evidence(
        plan,
        folder,
        stand.witness.truth(),
        stand.wire.frames[:alive],
        faults.happened,
        stand.stages,
        ending.report,
        tuple(stand.daemon.events.kept) if stand.services is not None else (),
        ending.error,
        ending.stuck,
        stand.ticks,
        faults.context.axis,
        faults.context.node,
        operator.frames_before_stop,
        stand.killed_ticks,
        stand.killed_cycle,
        tuple(faults.context.notes.items()),
        faults.second,
    )
    if plan.again and faults.happened is not None:
        return evidence._replace(again=life.again(stand, evidence.truth.position_m[-1]))
    return evidence
