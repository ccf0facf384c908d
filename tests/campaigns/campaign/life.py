"""The daemon's life on a stand, to its end by whatever; and another one behind it."""

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

WAY_MM = 2.0
AT_A_SWITCH = "limit switch: jog it away"
PROGRAM = """
[[step]]
kind = "move"
label = "back"
to_mm = {{ {aims} }}
feed_mm_min = 6000.0
"""
"""Of the run behind: towards the middle, from where the table was left."""


class Ending(NamedTuple):
    """Its report, the exception that ended it, and where it was stuck."""

    report: RunReport | None
    error: str
    stuck: str


def to_its_end(stand: Stand, machine: Coroutine[Any, Any, RunReport]) -> RunReport:
    """The daemon's life, by the stand's time. What ends it is raised; nothing of it outlives it."""

    async def whole() -> RunReport:
        task = asyncio.create_task(machine)
        stand.kill = task.cancel
        async with asyncio.timeout(RUN_LIMIT_S):
            return await task

    gc.disable()
    with stand.installed():
        asyncio.set_event_loop(stand.loop)
        try:
            return stand.loop.run_until_complete(whole())
        finally:
            close(stand)
            gc.enable()


def live(stand: Stand, machine: Coroutine[Any, Any, RunReport]) -> Ending:
    """The daemon's life, and what has ended it."""
    report: RunReport | None = None
    error = stuck = ""
    try:
        report = to_its_end(stand, machine)
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
    return Ending(report, error, stuck)


async def first(plan: Plan, stand: Stand) -> RunReport:
    """The run that the fault comes to."""
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


def again(stand: Stand, position_m: Sequence[float]) -> str:
    """Another run on the same nodes, whatever they were left in; what was wrong with it, or ""."""
    stand.begin_again()
    path = stand.folder / "again.toml"
    aims = ", ".join(
        f"{axis} = {-math.copysign(WAY_MM, at):g}" for axis, at in zip("xy", position_m, strict=True)
    )
    path.write_text(PROGRAM.format(aims=aims), encoding="utf-8")
    pacing: Any = stand.pacing
    machine = stand.machine.controller
    directory, learned = stand.folder / "again", stand.folder / "learned"
    program = load_program(path, machine)
    ending = live(stand, run_machine(machine, program, BUS, pacing, directory, learned_dir=learned))
    if ending.report is None:
        return ending.error or ending.stuck
    if any(abs(at) > SWITCH_MM * 1e-3 for at in position_m):
        refused = ending.report.failed and AT_A_SWITCH in ending.report.reason
        return "" if refused else "an axis stands at a limit switch, and the program was begun"
    if ending.report.failed or not ending.report.completed:
        return f"{ending.report.reason or 'not completed'}; noted were: {'; '.join(ending.report.events)}"
    return (
        "a drive has power in the end" if any(drive.motion.powered for drive in stand.bench._drives) else ""
    )


def close(stand: Stand) -> None:
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
