"""The page's process: started again when it dies, ended with the run, and never left behind."""

import asyncio
import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from servo_ctrl.daemon.page.page_process import NICENESS, kept_running

LIMIT_S = 120.0
"""A page gives way to everything else: beside busy processes it starts late."""
LIVES = """
import os, sys, time
with open(sys.argv[1], "a") as file:
    file.write(f"{os.getpid()}\\n")
print("served at some address", flush=True)
time.sleep(600)
"""
DIES = """
import os, sys
with open(sys.argv[1], "a") as file:
    file.write(f"{os.getpid()}\\n")
print("no such library", flush=True)
sys.exit(3)
"""
DEAF = "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN)\n" + LIVES
CONTROLLER = """
import asyncio, sys
from servo_ctrl.daemon.page.page_process import kept_running
async def main():
    async with kept_running([sys.executable, "-c", sys.argv[2], sys.argv[1]], print):
        await asyncio.sleep(60)
asyncio.run(main())
"""


def command(program: str, file: Path) -> list[str]:
    return [sys.executable, "-c", program, str(file)]


def pids(file: Path) -> list[int]:
    """Of the lives so far."""
    return [int(line) for line in file.read_text().splitlines()] if file.exists() else []


def stat_of(pid: int) -> list[str]:
    """State, parent and so on."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()


def alive(pid: int) -> bool:
    """Neither gone nor waiting to be buried."""
    try:
        return stat_of(pid)[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False


async def until(condition: Callable[[], Any]) -> None:
    async with asyncio.timeout(LIMIT_S):
        while not condition():  # noqa: ASYNC110  # other processes tell nobody
            await asyncio.sleep(0.02)


async def test_a_page_that_dies_is_restarted_and_its_last_output_reported(tmp_path: Path) -> None:
    file, notes = tmp_path / "pids", []
    async with kept_running(command(LIVES, file), notes.append):
        await until(lambda: len(pids(file)) == 1)
        os.kill(pids(file)[0], signal.SIGKILL)
        await until(lambda: len(pids(file)) == 2)
        assert alive(pids(file)[1])
    assert notes == ["the page has ended (status -9), again in 0.25 s: served at some address"]
    assert not any(alive(pid) for pid in pids(file))


@pytest.fixture(params=["SCHED_OTHER", "SCHED_BATCH"])
def policy(request: pytest.FixtureRequest) -> Iterator[None]:
    """A policy without priority, for the test's process; a simulator in lockstep sets the second."""
    before = os.sched_getscheduler(0)
    os.sched_setscheduler(0, getattr(os, request.param), os.sched_param(0))
    yield
    os.sched_setscheduler(0, before, os.sched_param(0))


@pytest.mark.usefixtures("policy")
async def test_a_killed_keeper_is_noted_and_started_again_beside_the_cycle(tmp_path: Path) -> None:
    file, notes = tmp_path / "pids", []
    async with kept_running(command(LIVES, file), notes.append):
        await until(lambda: len(pids(file)) == 1)
        first = pids(file)[0]
        os.kill(int(stat_of(first)[1]), signal.SIGKILL)
        await until(lambda: len(pids(file)) == 2)
        assert not alive(first)
        second = pids(file)[1]
        assert os.getpriority(os.PRIO_PROCESS, second) == min(19, os.nice(0) + NICENESS)
    assert notes == ["the supervisor of the page's process has ended (status -9), again in 1 s"]
    assert not alive(second)


async def test_a_page_gives_way_to_the_cycle_and_ctrl_c_is_not_for_it(tmp_path: Path) -> None:
    """Linux may weigh niceness within a session alone: sched(7), the autogroup feature."""
    file = tmp_path / "pids"
    async with kept_running(command(LIVES, file), print):
        await until(lambda: len(pids(file)) == 1)
        (page,) = pids(file)
        assert os.getpriority(os.PRIO_PROCESS, page) == min(19, os.nice(0) + NICENESS)
        assert os.getsid(page) == os.getsid(0)
        assert os.getpgid(page) != os.getpgid(0)


async def test_a_page_that_keeps_dying_is_restarted_with_growing_delay(tmp_path: Path) -> None:
    file, notes = tmp_path / "pids", []
    async with kept_running(command(DIES, file), notes.append):
        await until(lambda: len(notes) >= 3)
    pauses = [note.split(", ")[1].split(":")[0] for note in notes[:3]]
    assert pauses == ["again in 0.25 s", "again in 0.5 s", "again in 1 s"]
    assert "status 3" in notes[0]
    assert "no such library" in notes[0]


async def test_a_page_that_ignores_the_signal_is_killed(tmp_path: Path) -> None:
    file = tmp_path / "pids"
    async with kept_running(command(DEAF, file), print):
        await until(lambda: pids(file))
    assert not alive(pids(file)[0])


async def test_a_killed_controller_leaves_neither_page_nor_watchdog_behind(tmp_path: Path) -> None:
    file = tmp_path / "pids"
    controller = await asyncio.create_subprocess_exec(sys.executable, "-c", CONTROLLER, str(file), LIVES)
    try:
        await until(lambda: pids(file))
        page = pids(file)[0]
        supervisor = int(stat_of(page)[1])
        assert supervisor != controller.pid
    finally:
        controller.kill()
        await controller.wait()
    await until(lambda: not alive(page) and not alive(supervisor))
