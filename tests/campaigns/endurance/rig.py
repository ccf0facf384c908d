"""The table on a bus of its own, with its processes in sight: hub, simulator, and stations beside them."""

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
"""Its drives close the loops, so that a cycle may be long, and a week short."""
ANSWER_LIMIT_S = 30.0
PERIOD_US = 2000
"""At 1 kHz the table alone takes 70 % of 1 Mbit/s; what is left has no room for the delays of a hub."""


def table_at(period_us: int) -> MachineConfig:
    """The controller's side of the machine, at this SYNC period."""
    machine = load_machine(MACHINE)
    return machine.model_copy(update={"bus": machine.bus.model_copy(update={"sync_period_us": period_us})})


class Rig(NamedTuple):
    """A machine that is on the bus, and who carries it."""

    bus: str
    socket: Path
    pids: dict[str, int]
    """"hub" and "simulator"."""


def fifo_is_permitted() -> bool:
    """Whether this user may have SCHED_FIFO and locked memory."""
    try:
        with uninterrupted(fifo=True):
            return True
    except RealtimeError:
        return False


@contextlib.asynccontextmanager
async def rig(pacing: str, bitrate: int = 0, machine: Path = MACHINE) -> AsyncIterator[Rig]:
    """Hub and simulator for the block; `bitrate` 0 is a bus that is as fast as its slowest reader."""
    with tempfile.TemporaryDirectory(prefix="endurance-") as folder:
        socket = Path(folder) / "can.sock"
        hub = [sys.executable, "-m", "local_can", str(socket), "--bitrate", str(bitrate)]
        if pacing == "lockstep":
            hub.append("--batch")
        simulator = [str(Path(sys.executable).with_name("hil-sim")), "run", "--machine", str(machine)]
        simulator += ["--bus", f"localcan:{socket}", "--pacing", pacing]
        async with (
            running("the CAN hub", hub, "bus at"),
            running("hil-sim", simulator, "on the bus"),
        ):
            pids = {}
            for pid in children():
                command = command_line(pid)
                if str(socket) in command:
                    pids["hub" if "local_can" in command else "simulator"] = pid
            yield Rig(f"localcan:{socket}", socket, pids)


class Station:
    """A process of this folder beside the bus: a word on its input, a line of JSON on its output."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process

    async def ask(self, word: str) -> dict[str, Any]:
        """What the station answers; it is bounded."""
        if self._process.stdin is None or self._process.stdout is None:
            raise RuntimeError("no pipe to the station")
        self._process.stdin.write(f"{word}\n".encode())
        async with asyncio.timeout(ANSWER_LIMIT_S):
            line = await self._process.stdout.readline()
        if not line:
            raise RuntimeError("the station has ended")
        answer: dict[str, Any] = json.loads(line)
        return answer


@contextlib.asynccontextmanager
async def station(module: str, *arguments: str) -> AsyncIterator[Station]:
    """`tests.campaigns.endurance.MODULE` runs for the block, entered once it is on the bus."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", f"tests.campaigns.endurance.{module}", *arguments),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        cwd=REPOSITORY,
        start_new_session=True,  # Ctrl-C reaches us alone, and the records are still written
        preexec_fn=ends_with_its_parent(),
    )
    try:
        own = Station(process)
        await own.ask("ready")
        yield own
    finally:
        if process.returncode is None:
            process.terminate()
        await process.wait()
