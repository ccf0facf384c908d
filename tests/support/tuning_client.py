"""A program that asks a controller for a long motion of a tuning, and gives signs of life as `tune` does.

Arguments: the controller's socket, the machine file, a folder for the recording. Prints why there is none.
"""

import asyncio
import contextlib
import sys
from pathlib import Path

from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.config.load import load_machine
from servo_ctrl.excitation.measuring_motion import TuneError
from servo_ctrl.excitation.tuning_motion import TuningMotion
from servo_ctrl.hmi.link.machine_link import MachineLink
from servo_ctrl.tuning.controller_runs import ControllerRuns

WHO = Requester(user="otto", role="configure", address="192.0.2.8")


async def main(socket: Path, machine: Path, out: Path) -> None:
    """Ask for the motion."""
    link = MachineLink(socket)
    connection = asyncio.create_task(link.run())
    motion = TuningMotion("x", force_n=1.0, periods=8)
    try:
        await ControllerRuns(link, WHO, out).record(load_machine(machine), motion, "measure")
    except TuneError as error:
        print(error)
    connection.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await connection


if __name__ == "__main__":
    asyncio.run(main(*map(Path, sys.argv[1:])))
