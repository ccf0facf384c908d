"""Runs the daemon on a stand to its end, whatever ends it, and once more after a fault."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import math
from typing import TYPE_CHECKING, Any, NamedTuple

from servo_ctrl.config.load import load_program
from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.errors import ServoCtrlError
from tests.campaigns.campaign.machine import SWITCH_MM
from tests.campaigns.campaign.stand import BUS, RUN_LIMIT_S
from tests.campaigns.campaign.virtual_time import StuckError

if TYPE_CHECKING:
    from collections.abc import Coroutine, Sequence

    from servo_ctrl.daemon.run.report import RunReport
    from tests.campaigns.campaign.draw import Plan
    from tests.campaigns.campaign.stand import Stand

DISTANCE_MM = 2.0
AT_SWITCH_TEXT = "limit switch: jog it away"
PROGRAM = """
[[step]]
kind = "move"
label = "back"
to_mm = {{ {targets} }}
feed_mm_min = 6000.0
"""
"""Program of the next run: from the present position towards the middle."""


class Ending(NamedTuple):
    """The report of a run, the exception that ended it, and where it was stuck."""

    report: RunReport | None
    error: str
    stuck: str


def run_to_end(stand: Stand, machine: Coroutine[Any, Any, RunReport]) -> RunReport:
    """Run the daemon by the time of the stand; return its report or raise its exception."""

    async def run_task() -> RunReport:
        task = asyncio.create_task(machine)
        stand.kill = task.cancel
        async with asyncio.timeout(RUN_LIMIT_S):
            return await task

    gc.disable()
    with stand.installed():
        asyncio.set_event_loop(stand.loop)
        try:
            return stand.loop.run_until_complete(run_task())
        finally:
            close_loop(stand)
            gc.enable()


def run_daemon(stand: Stand, machine: Coroutine[Any, Any, RunReport]) -> Ending:
    """Run the daemon; return what ended it."""
    report: RunReport | None = None
    error = stuck = ""
    try:
        report = run_to_end(stand, machine)
    except TimeoutError:
        stuck = f"not over after {RUN_LIMIT_S:g} s of simulated time"
    except StuckError as exception:
        stuck = str(exception)
    except ServoCtrlError as exception:
        error = f"refused: {exception}"
    except asyncio.CancelledError:
        error = "cancelled"
    except Exception as exception:  # noqa: BLE001  # any exception is a result of the run
        error = f"{type(exception).__name__}: {exception}"
    return Ending(report, error, stuck)


async def faulty_run(plan: Plan, stand: Stand) -> RunReport:
    """Run the daemon in which the fault is injected."""
    stand.power_up()
    machine = stand.machine
    program = None if plan.stand_by else machine.program  # in standby the operator loads it
    options: dict[str, Any] = {"stand_by": plan.stand_by, "learned_dir": stand.folder / "learned"}
    pacing: Any = plan.pacing
    controller = machine.controller
    if plan.fault.broker:
        await stand.broker.start()
        controller = controller.model_copy(update={"mqtt": MqttConfig(port=stand.broker.port)})
    try:
        return await run_machine(controller, program, BUS, pacing, stand.folder / "recording", **options)
    finally:
        stand.broker.close()


def next_run(stand: Stand, position_m: Sequence[float]) -> str:
    """Make another run on the same nodes in their present state; return what was wrong with it, or ""."""
    stand.begin_next_run()
    path = stand.folder / "again.toml"
    targets = ", ".join(
        f"{axis} = {-math.copysign(DISTANCE_MM, axis_m):g}"
        for axis, axis_m in zip("xy", position_m, strict=True)
    )
    path.write_text(PROGRAM.format(targets=targets), encoding="utf-8")
    pacing: Any = stand.pacing
    machine = stand.machine.controller
    directory, learned = stand.folder / "again", stand.folder / "learned"
    program = load_program(path, machine)
    ending = run_daemon(stand, run_machine(machine, program, BUS, pacing, directory, learned_dir=learned))
    if ending.report is None:
        return ending.error or ending.stuck
    if any(abs(axis_m) > SWITCH_MM * 1e-3 for axis_m in position_m):
        refused = ending.report.failed and AT_SWITCH_TEXT in ending.report.reason
        return "" if refused else "an axis stands at a limit switch, and the program was begun"
    if ending.report.failed or not ending.report.completed:
        return f"{ending.report.reason or 'not completed'}; reported were: {'; '.join(ending.report.events)}"
    return (
        "a drive has power in the end"
        if any(drive.motion.powered for drive in stand.bench._drives.drives)
        else ""
    )


def close_loop(stand: Stand) -> None:
    """Cancel all tasks, stop the worker threads, and close the loop."""
    loop = stand.loop
    with contextlib.suppress(StuckError):
        remaining = asyncio.all_tasks(loop)
        for task in remaining:
            task.cancel()
        if remaining:
            loop.run_until_complete(asyncio.gather(*remaining, return_exceptions=True))
    loop.workers.shutdown()
    asyncio.set_event_loop(None)
    loop.close()
