"""The README is executed: its make targets and links exist, its three terminals move the table."""

import os
import re
import shlex
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
START_LIMIT_S, RUN_LIMIT_S = 120.0, 180.0


def code_blocks() -> list[list[str]]:
    """The commands of each sh block, comments left out."""
    blocks = re.findall(r"```sh\n(.*?)```", README, flags=re.DOTALL)
    return [[line.split("  #")[0].strip() for line in block.splitlines() if line.strip()] for block in blocks]


def with_venv() -> dict[str, str]:
    """The environment after `. .venv/bin/activate`."""
    return {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


@contextmanager
def running(command: str, ready: str) -> Iterator[None]:
    """Keep a command of the README running; enter when it has printed `ready`."""
    with subprocess.Popen(
        shlex.split(command),
        cwd=ROOT,
        env=with_venv(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        assert process.stdout is not None
        try:
            deadline = time.monotonic() + START_LIMIT_S
            for line in process.stdout:
                if ready in line:
                    break
                assert time.monotonic() < deadline, f"{command} is not ready"
            else:
                raise AssertionError(f"{command} ended")
            yield
        finally:
            process.terminate()
            process.communicate(timeout=20.0)


def test_every_make_target_of_the_readme_exists() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    named = set(re.findall(r"make ([a-z-]+)", README))
    assert named >= {"demo", "test"}
    for target in named:
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), target


def test_every_link_and_picture_of_the_readme_is_there() -> None:
    for link in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / link).exists(), link


def test_the_two_terminals_of_the_readme_move_the_table(tmp_path: Path) -> None:
    (block,) = [block for block in code_blocks() if any(line.startswith("hil-sim run") for line in block)]
    bus = str(tmp_path / "table.sock")
    simulator, controller = (line.replace("/tmp/table.sock", bus) for line in block if "table.sock" in line)
    with running(simulator, "on the bus"):
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
            probe.connect(bus)
        done = subprocess.run(
            shlex.split(controller),
            cwd=ROOT,
            env=with_venv(),
            capture_output=True,
            text=True,
            timeout=RUN_LIMIT_S,
            check=False,
        )
    assert done.returncode == 0, done.stderr
    assert "cycles" in done.stdout
