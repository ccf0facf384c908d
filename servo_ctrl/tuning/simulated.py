"""Tuning on a bus, or on the simulated machine if no bus is named."""

from servo_ctrl.daemon.run.report import Pacing
from servo_ctrl.hil_rig.simulated_machine import simulated_machine
from servo_ctrl.tuning.measurement import TuneError
from servo_ctrl.tuning.request import TuneRequest
from servo_ctrl.tuning.results import TuneResult
from servo_ctrl.tuning.session import TuneRun


async def tune_axis(request: TuneRequest, bus: str | None, pacing: Pacing) -> TuneResult:
    """Tune an axis; without a bus, on hil-sim in lockstep. Raises TuneError, and whatever a run raises."""
    if problem := request.objection():
        raise TuneError(problem)
    if bus is not None:
        return await TuneRun(request, bus, pacing).run()
    request.tell("starting hil-sim (the first start compiles the kernels) ...")
    # the broker of the machine file is told of the machine, not of its model
    request = request._replace(machine=request.machine.model_copy(update={"mqtt": None}))
    async with simulated_machine(request.machine.source.parent, "lockstep") as spec:
        return (await TuneRun(request, spec, "lockstep").run())._replace(simulated=True)
