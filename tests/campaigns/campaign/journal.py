"""The runs that were made, a line each, so that a campaign that is broken off goes on where it was.

The first line identifies what was run: where the sources have changed since, the campaign starts again.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

REPOSITORY = Path(__file__).parents[3]
SOURCES = ("servo_ctrl", "hil_sim", "machines/xy_table", "eds", "tests/campaigns/campaign")
FORMAT = 1


class Result(NamedTuple):
    """What became of one run."""

    seed: int
    fault: str
    state: str
    pacing: str
    happened: bool
    """Whether the state was reached and the fault came."""
    cycles: int | None
    """From the fault to the first frame that shows the reaction; None where there is to be none."""
    bound: int | None
    violations: tuple[str, ...]


def fingerprint() -> str:
    """Of the sources of both sides and of the campaign."""
    digest = hashlib.sha256()
    for folder in SOURCES:
        for path in sorted((REPOSITORY / folder).rglob("*")):
            if path.suffix in {".py", ".toml", ".eds"}:
                digest.update(path.relative_to(REPOSITORY).as_posix().encode() + path.read_bytes())
    digest.update((REPOSITORY / "docs" / "fault_policy.md").read_bytes())
    return digest.hexdigest()[:16]


class Journal:
    """Appended to after every run; `done` are those of the same sources."""

    def __init__(self, path: Path) -> None:
        self._path = path
        header = {"format": FORMAT, "sources": fingerprint()}
        self.done = _read(path, header)
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = [json.dumps(header), *(json.dumps(result) for result in self.done)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")

    def add(self, results: Iterable[Result]) -> None:
        """Keep these."""
        with self._path.open("a", encoding="utf-8") as file:
            for result in results:
                file.write(json.dumps(result) + "\n")
                self.done.append(result)


def _read(path: Path, header: dict[str, object]) -> list[Result]:
    """The results in the file; a line that was torn off is dropped."""
    if not path.exists():
        return []
    first, *lines = path.read_text(encoding="utf-8").splitlines() or [""]
    found: list[Result] = []
    try:
        if json.loads(first) != header:
            return []
        for line in lines:
            values = json.loads(line)
            found.append(Result(*values[:-1], tuple(values[-1])))
    except (json.JSONDecodeError, TypeError):
        return found
    return found
