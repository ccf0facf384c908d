"""The results of a campaign, a line per run, from which an interrupted campaign continues.

The first line identifies the sources: if they have changed since, the campaign starts again.
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
    """The result of one run."""

    seed: int
    fault: str
    state: str
    pacing: str
    injected: bool
    """Whether the state was reached and the fault injected."""
    cycles: int | None
    """Cycles from the fault to the first frame that shows the reaction; None if none is required."""
    bound: int | None
    violations: tuple[str, ...]


def fingerprint() -> str:
    """Return a checksum of the sources of controller, simulator and campaign."""
    digest = hashlib.sha256()
    for folder in SOURCES:
        for path in sorted((REPOSITORY / folder).rglob("*")):
            if path.suffix in {".py", ".toml", ".eds"}:
                digest.update(path.relative_to(REPOSITORY).as_posix().encode() + path.read_bytes())
    digest.update((REPOSITORY / "docs" / "fault_policy.md").read_bytes())
    return digest.hexdigest()[:16]


class Journal:
    """The file of results; `done` has those of the same sources."""

    def __init__(self, path: Path) -> None:
        self._path = path
        header = {"format": FORMAT, "sources": fingerprint()}
        self.done = _read(path, header)
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = [json.dumps(header), *(json.dumps(result) for result in self.done)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")

    def add(self, results: Iterable[Result]) -> None:
        """Append results."""
        with self._path.open("a", encoding="utf-8") as file:
            for result in results:
                file.write(json.dumps(result) + "\n")
                self.done.append(result)


def _read(path: Path, header: dict[str, object]) -> list[Result]:
    """Return the results in the file, without an incomplete last line."""
    if not path.exists():
        return []
    first, *lines = path.read_text(encoding="utf-8").splitlines() or [""]
    results: list[Result] = []
    try:
        if json.loads(first) != header:
            return []
        for line in lines:
            values = json.loads(line)
            results.append(Result(*values[:-1], tuple(values[-1])))
    except (json.JSONDecodeError, TypeError):
        return results
    return results
