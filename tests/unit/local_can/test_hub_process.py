"""The hub as a process: its socket, its end, its options."""

import os
import re
import signal
import stat
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from bus_messages import Attach, message, receive


def test_the_socket_is_for_its_owner_only(hub: Any) -> None:
    assert stat.S_IMODE(hub.path.stat().st_mode) == 0o600


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_the_hub_cleanly(hub: Any, number: int) -> None:
    hub.signal(number)
    _, log = hub.process.communicate(timeout=20.0)
    assert hub.process.returncode == 0
    assert "Traceback" not in log
    assert not hub.path.exists()


def run_hub(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "local_can", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)


def refused(path: Path) -> str:
    result = run_hub(str(path))
    assert result.returncode == 1
    assert re.fullmatch(r"[^\n]+\n", result.stderr), result.stderr
    return result.stderr


def test_a_second_hub_is_refused_and_the_first_goes_on(hub: Any, attach: Attach) -> None:
    first, second = attach(hub), attach(hub)
    assert f"a hub is at {hub.path} already" in refused(hub.path)
    first.send(message(0x10))
    assert receive(second, 1)[0].arbitration_id == 0x10


def test_the_socket_of_a_killed_hub_is_replaced(start_hub: Any, attach: Attach) -> None:
    killed = start_hub()
    killed.signal(signal.SIGKILL)
    killed.process.wait(timeout=20.0)
    assert killed.path.exists()
    attach(start_hub())


def test_a_file_that_is_no_socket_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("keep me")
    assert "that is not a socket" in refused(path)
    assert path.read_text() == "keep me"


def test_a_directory_that_is_not_there_is_named(tmp_path: Path) -> None:
    assert str(tmp_path / "absent" / "hub.sock") in refused(tmp_path / "absent" / "hub.sock")


@pytest.mark.parametrize("option", ["--bitrate", "--queue-frames", "--patience-ms"])
def test_an_option_that_is_no_count_is_named(tmp_path: Path, option: str) -> None:
    result = run_hub(str(tmp_path / "hub.sock"), option, "-1")
    assert result.returncode == 2
    assert f"argument {option}: " in result.stderr


def test_a_hub_for_lockstep_is_scheduled_in_turns(start_hub: Any) -> None:
    hub = start_hub("--batch")
    assert os.sched_getscheduler(hub.process.pid) == os.SCHED_BATCH
