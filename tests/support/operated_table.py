"""A simulated table under a controller in this process, operated over the local socket."""

import asyncio
import contextlib
import os
import signal
from collections.abc import AsyncIterator, Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.page.page_process import PageOptions
from servo_ctrl.daemon.run.report import RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.hmi.link.machine_link import MachineLink

LIMIT_S = 60.0
ANNA = Requester(user="anna", role="configure", address="192.0.2.7")


class Operated:
    """A run and the link to it."""

    def __init__(self, link: MachineLink, run: asyncio.Task[RunReport], machine: Path, socket: Path) -> None:
        self.link, self.run, self.machine, self.socket = link, run, machine, socket

    async def ask(self, do: str, **fields: Any) -> Any:
        return await self.link.request(ANNA, do, **fields)

    async def until(self, condition: Callable[[Any], Any]) -> None:
        """Wait until the condition holds for the status."""
        async with asyncio.timeout(LIMIT_S):
            while self.link.status is None or not condition(self.link.status):
                assert not self.run.done(), "the run has ended"
                await asyncio.sleep(0.02)

    async def stop(self) -> RunReport:
        if not self.run.done():
            os.kill(os.getpid(), signal.SIGTERM)
        return await self.run


@contextlib.asynccontextmanager
async def operated(
    bench: Any,
    tmp_path: Path,
    program: str | None,
    changes: Mapping[str, str] = MappingProxyType({}),
    *,
    period_us: int = 0,
    **options: Any,
) -> AsyncIterator[Operated]:
    """Run the table, with changes of its controller.toml, with a page's link; stop it at the end.

    `period_us`: least time between two SYNCs; 0 = as fast as the computer is.
    """
    machine_dir = bench.machine(dict(changes))
    # slower than the simulator's own bus: clients in lockstep have bounds in SYNC time
    bench.serve_bus(period_us)
    bench.simulate(machine_dir)
    machine = load_machine(machine_dir)
    path = machine_dir / "round.toml"
    path.write_text(program or "", encoding="utf-8")
    motion = None if program is None else load_program(path, machine)
    socket: asyncio.Future[Path] = asyncio.get_running_loop().create_future()
    page = PageOptions(None, socket.set_result)
    run = asyncio.create_task(
        run_machine(machine, motion, bench.bus_spec, "lockstep", tmp_path / "r", page=page, **options)
    )
    at = await asyncio.wait_for(socket, LIMIT_S)
    link = MachineLink(at)
    linked = asyncio.create_task(link.run())
    bound = Operated(link, run, machine_dir, at)
    try:
        yield bound
    finally:
        if not run.done():
            os.kill(os.getpid(), signal.SIGTERM)
        await asyncio.gather(run, return_exceptions=True)
        linked.cancel()
        await asyncio.gather(linked, return_exceptions=True)
