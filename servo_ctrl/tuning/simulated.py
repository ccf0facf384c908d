"""Tuning by a controller in charge, on a bus, or on the simulated machine if none of them is named."""

import asyncio
import contextlib
import getpass
from pathlib import Path

from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.daemon.run.report import Pacing
from servo_ctrl.excitation.measuring_motion import TuneError
from servo_ctrl.hil_rig.simulated_machine import simulated_machine
from servo_ctrl.hmi.link.machine_link import MachineLink
from servo_ctrl.tuning.controller_runs import ControllerRuns
from servo_ctrl.tuning.machine_runs import MachineRuns
from servo_ctrl.tuning.request import TuneRequest
from servo_ctrl.tuning.results import TuneResult
from servo_ctrl.tuning.session import TuneRun


async def tune_axis(request: TuneRequest, bus: str | None, pacing: Pacing) -> TuneResult:
    """Tune an axis; without a bus, on hil-sim in lockstep. Raises TuneError, and whatever a run raises."""
    if problem := request.objection():
        raise TuneError(problem)
    if bus is not None:
        return await TuneRun(request, _machine_runs(request, bus, pacing)).run()
    request.report_stage("starting hil-sim (the first start compiles the kernels) ...")
    # the broker of the machine file is told of the machine, not of its model
    request = request._replace(machine=request.machine.model_copy(update={"mqtt": None}))
    async with simulated_machine(request.machine.source.parent, "lockstep") as spec:
        runs = _machine_runs(request, spec, "lockstep")
        return (await TuneRun(request, runs).run())._replace(simulated=True)


async def tune_by_controller(request: TuneRequest, socket: Path, who: Requester | None = None) -> TuneResult:
    """Tune an axis of the machine that the controller at this local socket is in charge of.

    Its log says that `who` asked; None: this system user. Raises TuneError, also where nothing answers.
    """
    if problem := request.objection():
        raise TuneError(problem)
    link = MachineLink(socket)
    linked = asyncio.create_task(link.run())
    try:
        who = who or Requester(user=getpass.getuser(), role="operate", address="")
        return await TuneRun(request, ControllerRuns(link, who, request.out)).run()
    finally:
        linked.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await linked


def _machine_runs(request: TuneRequest, bus: str, pacing: Pacing) -> MachineRuns:
    return MachineRuns(request.machine, bus, pacing, request.out, request.show)
