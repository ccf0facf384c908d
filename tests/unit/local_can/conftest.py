"""A hub process at a temporary path, and buses attached to it; everything ends with the test."""

import contextlib
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can
import pytest

STOP_TIMEOUT_S = 20.0


@dataclass
class RunningHub:
    path: Path
    process: subprocess.Popen[str]

    def signal(self, number: int) -> None:
        self.process.send_signal(number)

    def stop(self) -> tuple[int, str]:
        """End it as a user would; its exit status and its log."""
        self.process.terminate()
        _, log = self.process.communicate(timeout=STOP_TIMEOUT_S)
        return self.process.returncode, log


@pytest.fixture
def start_hub(tmp_path: Path) -> Iterator[Callable[..., RunningHub]]:
    hubs: list[RunningHub] = []

    def start(*options: str) -> RunningHub:
        path = tmp_path / "hub.sock"
        command = [sys.executable, "-m", "local_can", str(path), *options]
        hub = RunningHub(path, subprocess.Popen(command, stderr=subprocess.PIPE, text=True))
        hubs.append(hub)
        assert hub.process.stderr is not None
        assert hub.process.stderr.readline() == f"local_can: bus at {path}\n"
        return hub

    yield start
    for hub in hubs:
        if hub.process.poll() is None:
            hub.signal(signal.SIGCONT)
            hub.stop()
        if hub.process.stderr:
            hub.process.stderr.close()


@pytest.fixture
def hub(start_hub: Callable[..., RunningHub]) -> RunningHub:
    return start_hub()


@pytest.fixture
def attach() -> Iterator[Callable[..., can.BusABC]]:
    with contextlib.ExitStack() as stack:

        def attach_one(hub: RunningHub, **options: Any) -> can.BusABC:
            return stack.enter_context(can.Bus(interface="localcan", channel=str(hub.path), **options))

        yield attach_one
