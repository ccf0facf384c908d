"""The commands of the pages are run as they are shown; commands_of_pages.toml says where, and why one is not.

The gate runs those that take a moment, in this process; `make tutorials` runs the others as processes. A bus
with hardware is the simulated table in lockstep here.
"""

import contextlib
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from page_commands import ROOT, Group, groups, shown, world
from typer.testing import CliRunner

from reconcile.cli.main import app as reconcile
from servo_ctrl.cli.main import app as servo_ctrl

ALL_OF_IT = os.environ.get("TUTORIALS") == "all"
GROUPS = groups()
APPS = {"servo-ctrl": servo_ctrl, "reconcile": reconcile}
DATA = ROOT.parent / "shared" / "data"
READY_WITHIN_S, ENDS_WITHIN_S = 900.0, 3600.0
"""Hangs, not paces."""
STOPPED = {0, 128 + signal.SIGINT, 128 + signal.SIGTERM}


def of(when: str) -> list[Group]:
    return [group for group in GROUPS if group.when == when]


def test_every_command_of_a_page_is_run_or_has_a_reason() -> None:
    seen = {one.command for one in shown() if one.page.parent.name != "tutorials"}
    run = {command for group in GROUPS for command in group.run}
    assert seen == seen & (run | {command for group in GROUPS for command, _ in group.beside})
    assert run <= seen, "no page shows it any more"
    assert {group.when for group in GROUPS} == {"gate", "all", "never"}
    assert all(group.why for group in of("never"))


@pytest.mark.parametrize("group", of("gate"), ids=lambda group: group.name)
def test_commands_that_take_a_moment(group: Group, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(world(tmp_path))
    for command in group.run:
        program, *words = shlex.split(command)
        done = CliRunner().invoke(APPS[program], words)
        assert done.exit_code == 0, f"{command}\n{done.output}{done.exception!r}"


@pytest.mark.timeout(0)  # every process has a bound of its own
@pytest.mark.skipif(not ALL_OF_IT, reason="takes minutes: make tutorials")
@pytest.mark.parametrize("group", of("all"), ids=lambda group: group.name)
def test_commands_that_take_longer(group: Group, tmp_path: Path) -> None:
    if group.needs and not DATA.is_dir():
        pytest.skip("the publishers' recordings are not here")
    world(tmp_path)
    (tmp_path / "data").symlink_to(DATA)
    with contextlib.ExitStack() as stack:
        for command, ready in group.beside:
            stack.enter_context(staying_open(command, ready, tmp_path))
        for command in group.run:
            done = subprocess.run(
                on_this_bus(command), cwd=tmp_path, env=environment(tmp_path), capture_output=True, text=True,
                check=False, timeout=ENDS_WITHIN_S,
            )  # fmt: skip
            assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}{done.stderr[-3000:]}"


def on_this_bus(command: str) -> list[str]:
    """A real bus is the simulated one, and its time is the simulated one."""
    here = re.sub(r"(socketcan:v?can0|localcan:/tmp/table.sock)", "localcan:table.sock", command)
    here = re.sub(r"(servo-ctrl (?:run|learn) (?!.*--pacing).*)", r"\1 --pacing lockstep", here)
    return shlex.split(here)


def environment(home: Path) -> dict[str, str]:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return {**os.environ, "PATH": path, "XDG_STATE_HOME": str(home / "state"), "COLUMNS": "120"}


@contextlib.contextmanager
def staying_open(command: str, ready: str, place: Path) -> Iterator[None]:
    """Run a command until the end of the block; it has begun when it has printed `ready`."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # what a shell has put behind ignores it
    log = place / f"{len(list(place.glob('*.log')))}.log"
    with log.open("w") as output:
        process = subprocess.Popen(
            on_this_bus(command), cwd=place, env=environment(place), stdout=output, stderr=output
        )
    try:
        deadline_s = time.monotonic() + READY_WITHIN_S
        while ready not in log.read_text():
            assert process.poll() is None, f"{command}\n{log.read_text()}"
            assert time.monotonic() < deadline_s, f"{command} is not ready\n{log.read_text()}"
            time.sleep(0.05)
        yield
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(READY_WITHIN_S) in STOPPED, f"{command}\n{log.read_text()}"
