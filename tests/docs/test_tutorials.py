"""The tutorials are executed, word for word: files are written, terminals opened, commands run in order.

A block with `title="NAME"` that is not a shell is that file; one that "stays open" runs beside the others.
What "takes minutes", what comes after it, and what other tests run ("moves the machine") is run by `make
tutorials`; the gate holds it against the programs' own parsers (test_commands_in_docs.py).
"""

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

import pytest
from forked_program import commands_folder

TUTORIALS = sorted((Path(__file__).parents[2] / "docs" / "tutorials").glob("*.md"))
BLOCK = re.compile(r'^```(\w+)(?: title="([^"]*)")?\n(.*?)^```', re.MULTILINE | re.DOTALL)
ALL_OF_IT = os.environ.get("TUTORIALS") == "all"
LEFT_OUT = () if ALL_OF_IT else ("takes minutes", "after learning", "moves the machine")
LIMIT_S = 600.0 if not ALL_OF_IT else 3600.0
"""A hang, not a pace."""


class Block(NamedTuple):
    """A fenced block of a tutorial."""

    language: str
    title: str
    text: str


def blocks(page: Path) -> list[Block]:
    return [Block(*found) for found in BLOCK.findall(page.read_text(encoding="utf-8"))]


def command(text: str) -> list[str]:
    """A real bus is the simulated one here."""
    on_this_bus = text.replace("socketcan:can0", "localcan:table.sock")
    on_this_bus = re.sub(r"(servo-ctrl run (?!.*--pacing).*)", r"\1 --pacing lockstep", on_this_bus)
    return ["bash", "-euo", "pipefail", "-c", on_this_bus]


def environment(home: Path) -> dict[str, str]:
    """The gate's programs are forks (`program_template`), those of `make tutorials` are a user's."""
    folders = [str(Path(sys.executable).parent), os.environ["PATH"]]
    if not ALL_OF_IT:
        folders.insert(0, str(commands_folder()))
    return {
        **os.environ,
        "PATH": os.pathsep.join(folders),
        "XDG_STATE_HOME": str(home / "state"),
        "COLUMNS": "120",
    }


@pytest.mark.timeout(0)  # every process has a bound of its own
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_works_word_for_word(page: Path, tmp_path: Path) -> None:
    opened: list[subprocess.Popen[str]] = []
    if any("takes minutes" in block.title for block in blocks(page)) and not ALL_OF_IT:
        pytest.skip("takes minutes: make tutorials")
    try:
        for block in blocks(page):
            if block.language != "sh":
                (tmp_path / block.title).write_text(block.text, encoding="utf-8")
            elif "stays open" in block.title:
                opened.append(stays_open(block, tmp_path))
            elif not any(word in block.title for word in LEFT_OUT):
                done = subprocess.run(
                    command(block.text),
                    cwd=tmp_path,
                    env=environment(tmp_path),
                    capture_output=True,
                    text=True,
                    check=False,
                    timeout=LIMIT_S,
                )
                allowed = {0, 1} if "exit 1" in block.title else {0}
                assert done.returncode in allowed, f"{block.text}\n{done.stdout}{done.stderr}"
    finally:
        for process in opened:
            process.terminate()
            process.communicate(timeout=60.0)


def stays_open(block: Block, tmp_path: Path) -> subprocess.Popen[str]:
    text = f"exec {block.text.strip()}"
    log = tmp_path / "first_terminal.txt"
    with log.open("w") as output:
        process = subprocess.Popen(
            command(text), cwd=tmp_path, env=environment(tmp_path), stdout=output, stderr=output, text=True
        )
    deadline = time.monotonic() + LIMIT_S
    while "on the bus" not in log.read_text():
        assert process.poll() is None, log.read_text()
        assert time.monotonic() < deadline, f"{block.text} is not ready"
        time.sleep(0.05)
    return process
