"""Makes the run of a plan, and collects its evidence."""

from __future__ import annotations

import logging
import shutil
from functools import partial
from random import Random
from typing import TYPE_CHECKING, Any, NamedTuple

from servo_ctrl.commands.stage import Stage
from tests.campaigns.campaign import daemon_run
from tests.campaigns.campaign.fault_context import MOVING, FaultContext
from tests.campaigns.campaign.machine import parsed_files_cached
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

SETTLING_S = 0.5
"""Simulated time of the nodes after the end of the daemon, seconds; chosen."""
SETTLING_REPEATS = 12
"""Bounds the repeats of that time, for an axis that only friction brakes; chosen."""
BOOT_FRAMES = 300
PAUSES = (0, 1, 2, 5, 20, 60, 150)
"""Ticks between two faults."""
SILENCING_FAULTS = frozenset({"death of a node", "mute node", "node silent"})
"""After these another fault of the same node has no effect, so that it takes the other axis."""


class Instant(NamedTuple):
    """When a fault was injected."""

    frame_index: int
    """Number of frames that were on the bus before."""
    cycle: int
    time_s: float
    stage: Stage
    """Stage of the daemon."""


class SecondFault(NamedTuple):
    """The second fault as it was injected."""

    injected: Instant
    axis: int
    node: int
    notes: dict[str, Any]


class Evidence(NamedTuple):
    """The evidence of a finished run. Cycles are those of the wire, counted by SYNCs."""

    plan: Plan
    folder: Path
    truth: Truth
    frames: list[Frame]
    injected: Instant | None
    """When the fault was injected; None = never."""
    stages: list[tuple[int, int]]
    report: RunReport | None
    reported: tuple[str, ...]
    """Events of the daemon, also of a killed one."""
    error: str
    """Kind and text of the exception that ended the run; "" without one."""
    stuck: str
    ticks: int
    axis: int
    node: int
    frames_before_stop: int | None = None
    """Number of frames when the operator requested the end of the run."""
    killed_ticks: int = 0
    """Ticks before the controller was killed."""
    killed_cycle: int | None = None
    """Cycle in which it was killed."""
    notes: tuple[tuple[str, Any], ...] = ()
    """Facts that the fault recorded for the oracles."""
    second: SecondFault | None = None
    next_run_problem: str = ""
    """What was wrong with the next run."""


def run(plan: Plan, machine: CampaignMachine, folder: Path) -> Evidence:
    """Make the run in this empty folder."""
    logging.disable()  # the events have all messages of the daemon
    try:
        with parsed_files_cached():
            return _run(plan, machine, folder)
    finally:
        logging.disable(logging.NOTSET)


class _Injection:
    """Injects the faults of a plan, and keeps when."""

    def __init__(self, plan: Plan, stand: Stand, rng: Random) -> None:
        self.context, self.second_context = FaultContext(stand, rng), FaultContext(stand, rng)
        if plan.fault.name in SILENCING_FAULTS:
            self.second_context.take_axis(1 - self.context.axis)
        self.injected: Instant | None = None
        self.second: SecondFault | None = None
        self._plan, self._stand, self._rng = plan, stand, rng

    def inject_within_frames(self, fewest: int, most: int) -> None:
        """Inject the first fault after a random number of frames; 0 = at once."""
        wire = self._stand.wire
        wire.countdown, wire.on_zero = self._rng.randint(fewest, most), self._inject_first
        if not wire.countdown:
            self._inject_first()

    def inject_second(self) -> None:
        """Inject the second fault, if the first was injected and this stage allows it."""
        fault, second_context, now = self._plan.second, self.second_context, self._now()
        if fault is not None and self.injected is not None and _is_possible(fault, now.stage):
            self.second = SecondFault(now, second_context.axis, second_context.node, second_context.notes)
            fault.inject(second_context)

    def undo(self) -> None:
        """Restore all replaced functions, the last one first, and cancel a pending fault."""
        self._stand.wire.countdown = 0
        for undo in reversed((*self.context.undo, *self.second_context.undo)):
            undo()

    def _inject_first(self) -> None:
        self.injected = self._now()
        self._plan.fault.inject(self.context)

    def _now(self) -> Instant:
        stand = self._stand
        stage = Stage.BOOTING if stand.services is None else stand.daemon.stage
        return Instant(len(stand.wire.frames), stand.wire.cycle, stand.loop.time(), stage)


def _is_possible(fault: Fault, stage: Stage) -> bool:
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
        faults.inject_within_frames(1, BOOT_FRAMES)
    inject = partial(faults.inject_within_frames, 0, 8)
    operator = Operator(stand, rng, plan.state, inject, plan.fault.ticks_after, stand_by=plan.stand_by)
    if plan.second is not None:
        operator.second, operator.pause = faults.inject_second, rng.choice(PAUSES)
    try:
        ending = daemon_run.run_daemon(stand, daemon_run.faulty_run(plan, stand))
    finally:
        faults.undo()
    frames_of_daemon = len(stand.wire.frames)
    if not stand.wire.nodes_dead:
        stand.wire.nodes = stand.bench.handle
        stand.advance_nodes(SETTLING_S)
        for _ in range(SETTLING_REPEATS):
            if stand.truth_recorder.is_at_standstill():
                break
            stand.advance_nodes(SETTLING_S)
    evidence = Evidence(
        plan=plan,
        folder=folder,
        truth=stand.truth_recorder.truth(),
        frames=stand.wire.frames[:frames_of_daemon],
        injected=faults.injected,
        stages=stand.stages,
        report=ending.report,
        reported=tuple(stand.daemon.events.kept) if stand.services is not None else (),
        error=ending.error,
        stuck=ending.stuck,
        ticks=stand.ticks,
        axis=faults.context.axis,
        node=faults.context.node,
        frames_before_stop=operator.frames_before_stop,
        killed_ticks=stand.killed_ticks,
        killed_cycle=stand.killed_cycle,
        notes=tuple(faults.context.notes.items()),
        second=faults.second,
    )
    if plan.next_run and faults.injected is not None:
        return evidence._replace(next_run_problem=daemon_run.next_run(stand, evidence.truth.position_m[-1]))
    return evidence
