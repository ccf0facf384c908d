"""A simulated table under the real controller with its page, as processes in lockstep, which are forks.

Lockstep takes all the time there is, even in standby, and a page that starves misses rows: SYNC is paced.
"""

import contextlib
import re
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from child_process import terminate
from forked_program import PACED_HUB, commands_folder
from live_page import await_connection
from machine_files import REPOSITORY, XY_TABLE, text_of, write_controller
from playwright.sync_api import BrowserContext, Page
from program_steps import circle_about_origin

START_LIMIT_S = 300.0  # on a busy machine, kernels compiled again
PAGE_LIMIT_S = 300.0
LONG_CYCLE = {"sync_period_us = 1000": "sync_period_us = 2000"}
PERIOD_US = 2000
"""From one SYNC to the next at the earliest: real time at half the cost of 1 ms."""

SHORT_LEARNING = {
    "radius_mm = 50.0": "radius_mm = 1.0\ntrailing = false",
    "accelerations_mm_s2 = [2.0, 8.0, 30.0, 120.0]": "accelerations_mm_s2 = [40.0, 50.0, 60.0, 70.0]",
    "jerk_mm_s3 = 50000.0": "jerk_mm_s3 = 500000.0",
}
"""35 strokes of a second around the circle's reverse acceleration; at higher ones the loop itself lags."""
# reverse acceleration 60 mm/s^2; twelve reversals of each axis, for the median is of eight
SHORT_CIRCLE = circle_about_origin(2.0, 660.0, 6.0, label="circle", ramp_s=0.1, move_mm_min=1000.0)


def table_directory(directory: Path, changes: Mapping[str, str], programs: Mapping[str, str]) -> Path:
    """Write the X-Y table into a directory: controller.toml with changes, programs by file name."""
    (directory / "programs").mkdir(parents=True)
    write_controller(directory, text_of(XY_TABLE / "controller.toml", {**LONG_CYCLE, **changes}))
    (directory / "plant.toml").write_text(text_of(XY_TABLE / "plant.toml"), encoding="utf-8")
    for name, content in programs.items():
        (directory / "programs" / name).write_text(content, encoding="utf-8")
    return directory


class ServedTable(NamedTuple):
    """A simulated table under the real controller with its page."""

    url: str
    restart_simulator: Callable[[], None]
    """Kills hil-sim, also in motion, and starts it again."""
    kill_controller: Callable[[], None]
    """Kills servo-ctrl, also in motion."""
    start_controller: Callable[[], None]
    """Starts servo-ctrl again."""


@contextlib.contextmanager
def served_table(
    machine: Path, out: Path, port: int, environment: dict[str, str], *, period_us: int = PERIOD_US
) -> Iterator[ServedTable]:
    """Serve the machine in `machine` with drives off; learned results are in `out`.

    The page is a service of its own: the controller's own page gives way to every other process, so that
    beside a whole run of tests it answers after minutes, and loses connections.
    """
    can, listen = out / "can.sock", f"127.0.0.1:{port}"
    private = out / "page"
    private.mkdir(mode=0o700)
    page: list[str | Path] = ["--hmi-socket", private / "page.sock"]
    bus = ["--machine", machine, "--bus", f"localcan:{can}", "--pacing", "lockstep"]
    commands = commands_folder()
    hub = subprocess.Popen([commands / PACED_HUB[0], *PACED_HUB[1:], can, str(period_us)])
    try:
        while not can.exists():
            assert hub.poll() is None
            time.sleep(0.05)
        with contextlib.ExitStack() as stack:

            def simulate(log: str) -> subprocess.Popen[bytes]:
                simulator = [commands / "hil-sim", "run", *bus]
                return stack.enter_context(_running(simulator, out / log, "on the bus", environment))

            def control(name: str) -> subprocess.Popen[bytes]:
                kept = ["--record", out / name, "--learned", out / "learned"]
                run = [commands / "servo-ctrl", "run", *bus, *kept, *page]
                return stack.enter_context(_running(run, out / f"{name}.log", "standby", environment))

            simulator, controller = simulate("hil.log"), control("run")
            serve: list[str | Path] = [commands / "python3", "-m", "servo_ctrl.hmi", "serve"]
            serve += ["--socket", private / "page.sock", "--listen", listen, "--recordings", out]
            stack.enter_context(_running(serve, out / "page.log", "", environment))

            def restart_simulator() -> None:
                simulator.kill()
                simulator.wait(timeout=10.0)
                simulate("hil_again.log")

            def kill_controller() -> None:
                controller.kill()
                controller.wait(timeout=10.0)

            def start_controller() -> None:
                control("run_again")

            yield ServedTable(f"http://{listen}", restart_simulator, kill_controller, start_controller)
    finally:
        hub.terminate()
        hub.wait(timeout=10.0)


def opened(context: BrowserContext, url: str) -> Page:
    """Open the page as soon as its process serves it."""
    page = context.new_page()
    deadline_s = time.monotonic() + PAGE_LIMIT_S
    while True:
        try:
            page.goto(url)
        except Exception:  # noqa: BLE001  # the page's process is not there yet
            assert time.monotonic() < deadline_s
            time.sleep(0.2)
        else:
            await_connection(page)
            return page


@contextlib.contextmanager
def _running(
    command: list[str | Path], log: Path, sign: str, environment: dict[str, str]
) -> Iterator[subprocess.Popen[bytes]]:
    """Run a process: enter when its log matches `sign`, terminate it on leaving."""
    with log.open("wb") as output:
        process = subprocess.Popen(command, stdout=output, stderr=output, cwd=REPOSITORY, env=environment)
        try:
            deadline_s = time.monotonic() + START_LIMIT_S
            while not re.search(sign, log.read_text(errors="replace")):
                assert process.poll() is None, log.read_text()
                assert time.monotonic() < deadline_s, log.read_text()
                time.sleep(0.05)
            yield process
        finally:
            terminate(process, 20.0)
