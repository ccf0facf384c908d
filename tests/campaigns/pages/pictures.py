"""The pictures of docs, drawn by the commands that docs/pictures.toml declares."""

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[3]
DECLARED = ROOT / "docs" / "pictures.toml"
TAKES = ("seconds", "minutes", "hours")


class Drawn(NamedTuple):
    """A command and its pictures."""

    command: str
    takes: str
    files: dict[str, str]
    """Place below docs by the name that the command gives."""


def declared() -> tuple[list[Drawn], set[str]]:
    """Return what is drawn by commands, and the pictures that are kept as they are."""
    document: dict[str, Any] = tomllib.loads(DECLARED.read_text(encoding="utf-8"))
    kept = {file for one in document["kept"] for file in one["files"]}
    return [Drawn(one["command"], one["takes"], one["files"]) for one in document["drawn"]], kept


def draw(one: Drawn, docs: Path) -> list[str]:
    """Run a command and put its pictures below `docs`; return those that have changed.

    Raises:
        CalledProcessError: the command has failed.
    """
    changed = []
    with tempfile.TemporaryDirectory(prefix="servo-pictures-") as name:
        words = [word.replace("OUT", name) for word in shlex.split(one.command)]
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        environment = {**os.environ, "PATH": path}
        subprocess.run(words, cwd=ROOT, env=environment, check=True, stdout=subprocess.DEVNULL)
        for made, place in one.files.items():
            new, old = Path(name) / made, docs / place
            if not old.exists() or new.read_bytes() != old.read_bytes():
                old.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(new, old)
                changed.append(place)
    return changed


def draw_all(most: str, docs: Path) -> list[str]:
    """Draw all pictures that take no longer than `most`; return those that have changed."""
    wanted = TAKES[: TAKES.index(most) + 1]
    drawn, _ = declared()
    return [place for one in drawn if one.takes in wanted for place in draw(one, docs)]
