"""What the documents promise: docs/fault_policy.md read as tables, event x stage -> reaction, and the bounds.

The page is what the campaign holds the machine against, not the code; a test of its own holds the page
against the code's table.
"""

from __future__ import annotations

import math
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

PAGE = Path(__file__).parents[3] / "docs" / "fault_policy.md"
HEARTBEAT_CYCLES = 20
"""Of the campaign's machine, whose period is 1 ms."""
UNITS = {"runaway_ms": 5, "saturation_ms": 60, "limit_switch_syncs": 10}
"""Its keys that the page names, in cycles."""


class Bound(NamedTuple):
    """Cycles: from the cause to the event, and from the event to the frames that carry the reaction."""

    seen: int
    reacts: int

    @property
    def cycles(self) -> int:
        """Both, and the cycle in whose midst the fault came."""
        return self.seen + self.reacts + 1


def rows(text: str, first_column: str) -> list[dict[str, str]]:
    """The rows of all Markdown tables whose header begins with this column and has more than two."""
    found: list[dict[str, str]] = []
    header: list[str] = []
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")] if line.startswith("|") else []
        if not cells:
            header = []
        elif not header:
            header = cells if cells[0] == first_column else ["-"]
        elif header[0] == first_column and not set(cells[0]) <= set("-: "):
            found.append(dict(zip(header, cells, strict=True)))
    return found


@cache
def _tables() -> list[dict[str, str]]:
    return rows(PAGE.read_text(encoding="utf-8"), "event")


@cache
def reactions() -> dict[str, dict[str, str]]:
    """event -> stage -> "hold", "quick stop", "cut off", "disable", or "" for none."""
    return {row["event"]: row for row in _tables() if "booting" in row}


@cache
def bounds(*, lockstep: bool) -> dict[str, Bound]:
    """event -> bound."""
    return {
        row["event"]: Bound(_seen(row, lockstep=lockstep), int(row["reacts within"]))
        for row in _tables()
        if "seen within" in row
    }


def _seen(row: dict[str, str], *, lockstep: bool) -> int:
    """A number of cycles, or so many ms, heartbeat times or times the value of a key of the machine file."""
    text = row["seen within"]
    if lockstep and row["event"] == "inputs missing":
        return 1
    times = max((float(number) for number in re.findall(r"[0-9]+(?:[.][0-9]+)?", text)), default=1.0)
    key = re.search(r"`(?:[a-z]+[.])?([a-z_]+)`", text)
    unit = UNITS[key[1]] if key is not None else HEARTBEAT_CYCLES if "heartbeat" in text else 1
    return math.ceil(times * unit)
