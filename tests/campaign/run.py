"""A run by its number: what is drawn, how it goes, and what is left of it as evidence."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import logging
import shutil
from random import Random
from typing import TYPE_CHECKING, Any, NamedTuple

from servo_ctrl.axis.fault_policy import Stage
from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.daemon.supervisor import run_machine
from tests.campaign import faults
from tests.campaign.machine import parsed_files_kept
from tests.campaign.scene import Scene
from tests.campaign.script import Operator
from tests.campaign.stand import BUS, RUN_LIMIT_S, Stand
from tests.campaign.virtual_time import StuckError

if TYPE_CHECKING:
    from pathlib import Path

    from servo_ctrl.daemon.report import RunReport
    from tests.campaign.machine import CampaignMachine
    from tests.campaign.scene import Fault
    from tests.campaign.truth import Truth
    from tests.campaign.wire import Frame

AFTERLIFE_S = 0.5
COASTING = 6
"""So many times as long at most, for an axis that nothing brakes but its friction."""
BOOT_FRAMES = 300


class Plan(NamedTuple):
    """What is drawn for a run before it begins."""

    seed: int
    fault: Fault
    state: str
    pacing: str
    stand_by: bool


class Evidence(NamedTuple):
    """What is known of a run when it is over. Cycles are those of the wire, counted by SYNCs."""

    plan: Plan
    folder: Path
    truth: Truth
    frames: list[Frame]
    happened: tuple[int, int, float, Stage] | None
    """Place among the frames, cycle, time (s) and daemon's stage when the fault came; None: it did not."""
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
    asked: int | None = None
    """Place among the frames when the operator wanted the run to end."""
    killed_ticks: int = 0
    """Ticks before the controller was killed."""
    killed_cycle: int | None = None
    """Cycle in which it was killed."""
    said: tuple[tuple[str, Any], ...] = ()
    """What the fault wanted to be remembered."""


def draw(seed: int) -> Plan:
    """The plan of this number; all faults and states come round, chance does the rest."""
    rng = Random(seed)
    pairs = [(fault, state) for fault in faults.ALL for state in fault.states]
    fault, state = pairs[seed % len(pairs)] if rng.random() < 0.5 else rng.choice(pairs)
    stand_by = state not in {"booting", "starting", "running", "stopping"} or rng.random() < 0.6
    return Plan(seed, fault, state, rng.choice(fault.pacings), stand_by)


def run(plan: Plan, machine: CampaignMachine, folder: Path) -> Evidence:
    """Make the run in this folder, which is empty."""
    logging.disable()  # what the daemon has to tell is in its events
    try:
        with parsed_files_kept():
            return _run(plan, machine, folder)
    finally:
        logging.disable(logging.NOTSET)


def _run(plan: Plan, machine: CampaignMachine, folder: Path) -> Evidence:
    rng = Random(plan.seed ^ 0x5EED)
    shutil.copytree(machine.learned, folder / "learned")
    stand = Stand(machine, folder, plan.pacing)
    stand.sdo_timeout_s = plan.fault.sdo_timeout_s
    scene = Scene(stand, rng)
    happened: list[tuple[int, int, float, Stage]] = []

    def inject() -> None:
        stage = Stage.BOOTING if stand.assembly is None else stand.daemon.stage
        happened.append((len(stand.wire.frames), stand.wire.cycle, stand.loop.time(), stage))
        plan.fault.inject(scene)

    def happen() -> None:
        """At once, or some frames on."""
        stand.wire.countdown, stand.wire.on_zero = rng.randint(0, 8), inject
        if not stand.wire.countdown:
            inject()

    if plan.state == "booting":
        stand.wire.countdown, stand.wire.on_zero = rng.randint(1, BOOT_FRAMES), inject
    operator = Operator(stand, rng, plan.state, happen, plan.fault.watched, stand_by=plan.stand_by)
    try:
        report, error, stuck = _live(plan, stand)
    finally:
        for undo in scene.undo:
            undo()
    alive = len(stand.wire.frames)
    if plan.fault.kills != "nodes":
        stand.wire.nodes = stand.bench.handle
        stand.afterlife(AFTERLIFE_S)
        for _ in range(COASTING):
            if stand.witness.rests():
                break
            stand.afterlife(AFTERLIFE_S)
    noted = tuple(stand.daemon.events.kept) if stand.assembly is not None else ()
    return Evidence(
        plan,
        folder,
        stand.witness.truth(),
        stand.wire.frames[:alive],
        happened[0] if happened else None,
        stand.stages,
        report,
        noted,
        error,
        stuck,
        stand.ticks,
        scene.axis,
        scene.node,
        operator.asked,
        stand.killed_ticks,
        stand.killed_cycle,
        tuple(scene.said.items()),
    )


def _live(plan: Plan, stand: Stand) -> tuple[RunReport | None, str, str]:
    """The daemon's life: its report, the exception that ended it, and where it was stuck."""
    report, error, stuck = None, "", ""

    async def whole() -> RunReport:
        task = asyncio.create_task(_machine(plan, stand))
        stand.kill = task.cancel
        async with asyncio.timeout(RUN_LIMIT_S):
            return await task

    gc.disable()
    with stand.installed():
        asyncio.set_event_loop(stand.loop)
        try:
            report = stand.loop.run_until_complete(whole())
        except TimeoutError:
            stuck = f"not over after {RUN_LIMIT_S:g} s of simulated time"
        except StuckError as failure:
            stuck = str(failure)
        except ServoCtrlError as failure:
            error = f"refused: {failure}"
        except asyncio.CancelledError:
            error = "cancelled"
        except Exception as failure:  # noqa: BLE001  # whatever it is, it is what the run has shown
            error = f"{type(failure).__name__}: {failure}"
        finally:
            _close(stand)
            gc.enable()
    return report, error, stuck


async def _machine(plan: Plan, stand: Stand) -> RunReport:
    stand.power_up()
    machine = stand.machine
    program = None if plan.stand_by else machine.program  # who stands by is given it by the operator
    options: dict[str, Any] = {"stand_by": plan.stand_by, "learned_dir": stand.folder / "learned"}
    pacing: Any = plan.pacing
    controller = machine.controller
    if plan.fault.broker:
        await stand.broker.start()
        controller = controller.model_copy(update={"mqtt": MqttConfig(port=stand.broker.port)})
    try:
        return await run_machine(controller, program, BUS, pacing, stand.folder / "recording", **options)
    finally:
        stand.broker.die()


def _close(stand: Stand) -> None:
    """Nothing of the run outlives it."""
    loop = stand.loop
    with contextlib.suppress(StuckError):
        left = asyncio.all_tasks(loop)
        for task in left:
            task.cancel()
        if left:
            loop.run_until_complete(asyncio.gather(*left, return_exceptions=True))
    loop.workers.shutdown()
    asyncio.set_event_loop(None)
    loop.close()
