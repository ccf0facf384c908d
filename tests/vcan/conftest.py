"""Buses, simulators and skips for the tests that want the real thing.

A test that takes `bus_spec` runs on localcan everywhere and, marked vcan, on vcan0 where there is one.
Programs are forked: one takes 4 s to start in user-mode Linux. `test_compose_commands.py` has the real ones.
"""

import contextlib
import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from forked_program import commands_folder

ROOT = Path(__file__).resolve().parents[2]
STOP_TIMEOUT_S = 240.0


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    if Path("/sys/class/net/vcan0").exists() or "VCAN_REQUIRED" in os.environ:
        return
    skip = pytest.mark.skip(reason="no interface vcan0 here; `make test-vcan` runs this in user-mode Linux")
    for item in items:
        if item.get_closest_marker("vcan"):
            item.add_marker(skip)


@pytest.fixture(scope="module")
def start() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start a command of ours and wait for the line that says it is ready; ended with the file's tests."""
    with contextlib.ExitStack() as stack:

        def start_one(program: str, *arguments: str, ready: str) -> subprocess.Popen[str]:
            command = [commands_folder() / program, *arguments]
            process = stack.enter_context(
                subprocess.Popen(
                    command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
                )
            )
            stack.callback(process.wait, STOP_TIMEOUT_S)
            stack.callback(process.terminate)
            assert process.stdout is not None
            line = process.stdout.readline()
            assert ready in line, line + process.stdout.read()
            return process

        yield start_one


@pytest.fixture(scope="module")
def localcan(start: Callable[..., subprocess.Popen[str]], tmp_path_factory: pytest.TempPathFactory) -> str:
    """Bus option of a hub that runs as long as the file's tests."""
    path = tmp_path_factory.mktemp("hub") / "bus.sock"
    start("python3", "-m", "local_can", str(path), ready="bus at")
    return f"localcan:{path}"


@pytest.fixture(scope="module", params=["localcan", pytest.param("vcan0", marks=pytest.mark.vcan)])
def bus_spec(request: pytest.FixtureRequest) -> str:
    """Bus option INTERFACE:CHANNEL."""
    if request.param == "vcan0":
        return "socketcan:vcan0"
    return str(request.getfixturevalue("localcan"))


@pytest.fixture(scope="module")
def start_simulator(start: Callable[..., subprocess.Popen[str]]) -> Callable[[str], subprocess.Popen[str]]:
    """Put the X-Y table on a bus."""

    def start_one(bus_spec: str) -> subprocess.Popen[str]:
        return start(
            "hil-sim", "run", "--machine", "machines/xy_table", "--bus", bus_spec, ready="hil-sim: on the bus"
        )

    return start_one


@pytest.fixture(scope="module")
def simulator(start: Callable[..., object]) -> None:
    """The X-Y table on vcan0 by the wall clock: heartbeats come also while nobody sends a SYNC."""
    bus = ["--bus", "socketcan:vcan0", "--pacing", "realtime"]
    start("hil-sim", "run", "--machine", "machines/xy_table", *bus, ready="hil-sim: on the bus")
