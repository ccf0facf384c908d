"""Starts the processes of a simulated table on its own bus: hub, simulator, and further stations."""

import asyncio
import contextlib
import json
import sys
import tempfile
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.realtime import RealtimeError, uninterrupted
from servo_ctrl.hil_rig.simulated_machine import ends_with_its_parent, running
from tests.campaigns.bench.process_time import children, command_line

REPOSITORY = Path(__file__).parents[3]
MACHINE = REPOSITORY / "machines" / "xy_table"
CSP_TABLE = Path(__file__).parent / "csp_table"
"""A table whose drives close the loops, so that a long cycle suffices and a simulated week is short."""
RESPONSE_TIMEOUT_S = 30.0
"""Bounds the wait for the response of a station, seconds; chosen."""
PERIOD_US = 2000
"""SYNC period in real time, microseconds; chosen: at 1 kHz the table alone takes 70 % of 1 Mbit/s, without
reserve for the delays of a hub."""


def table_at(period_us: int) -> MachineConfig:
    """Return the machine of the controller with this SYNC period."""
    machine = load_machine(MACHINE)
    return machine.model_copy(update={"bus": machine.bus.model_copy(update={"sync_period_us": period_us})})


class Rig(NamedTuple):
    """A running simulated machine, and the processes of its bus."""

    bus: str
    socket: Path
    pids: dict[str, int]
    """Process ids of "hub" and "simulator"."""


def fifo_is_permitted() -> bool:
    """Return whether this user may use SCHED_FIFO and lock memory."""
    try:
        with uninterrupted(fifo=True, realtime=True):
            return True
    except RealtimeError:
        return False


@contextlib.asynccontextmanager
async def rig(pacing: str, bitrate: int = 0, machine: Path = MACHINE) -> AsyncIterator[Rig]:
    """Run hub and simulator for the block; with `bitrate` 0 the bus is as fast as its slowest reader."""
    with tempfile.TemporaryDirectory(prefix="endurance-") as folder:
        socket = Path(folder) / "can.sock"
        hub = [sys.executable, "-m", "local_can", str(socket), "--bitrate", str(bitrate)]
        if pacing == "lockstep":
            hub.append("--batch")
        simulator = [str(Path(sys.executable).with_name("hil-sim")), "run", "--machine", str(machine)]
        simulator += ["--bus", f"localcan:{socket}", "--pacing", pacing]
        async with running("the CAN hub", hub, "bus at"), running("hil-sim", simulator, "on the bus"):
            pids = {}
            for pid in children():
                command = command_line(pid)
                if str(socket) in command:
                    pids["hub" if "local_can" in command else "simulator"] = pid
            yield Rig(f"localcan:{socket}", socket, pids)


class Station:
    """A station process: each line on its input gives a line of JSON on its output."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process

    async def request(self, command: str) -> dict[str, Any]:
        """Send a command; return the response of the station. Raises TimeoutError, RuntimeError."""
        if self._process.stdin is None or self._process.stdout is None:
            raise RuntimeError("no pipe to the station")
        self._process.stdin.write(f"{command}\n".encode())
        async with asyncio.timeout(RESPONSE_TIMEOUT_S):
            line = await self._process.stdout.readline()
        if not line:
            raise RuntimeError("the station has ended")
        response: dict[str, Any] = json.loads(line)
        return response


@contextlib.asynccontextmanager
async def station(module: str, *arguments: str) -> AsyncIterator[Station]:
    """Run `tests.campaigns.endurance.MODULE` for the block, which begins once it is on the bus."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", f"tests.campaigns.endurance.{module}", *arguments),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        cwd=REPOSITORY,
        start_new_session=True,  # so that Ctrl-C ends only this process, which then writes its results
        preexec_fn=ends_with_its_parent(),
    )
    try:
        started = Station(process)
        await started.request("ready")
        yield started
    finally:
        if process.returncode is None:
            process.terminate()
        await process.wait()
