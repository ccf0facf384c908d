"""Reads the tables of docs/fault_policy.md: the reaction to each event in each stage, and the bounds.

The campaign compares the machine with the page, not with the code; another test compares the page with the
table of the code.
"""

from __future__ import annotations

import math
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

PAGE = Path(__file__).parents[3] / "docs" / "fault_policy.md"
HEARTBEAT_CYCLES = 20
"""Heartbeat time of the machine of the campaign, whose period is 1 ms."""
UNITS = {"runaway_ms": 5, "saturation_ms": 60, "limit_switch_syncs": 10}
"""Values of its keys that the page names, in cycles."""


class Bound(NamedTuple):
    """Cycles: from the cause to the event, and from the event to the frames that carry the reaction."""

    detection: int
    reaction: int

    @property
    def cycles(self) -> int:
        """Both, and the cycle in which the fault was injected."""
        return self.detection + self.reaction + 1


def rows(text: str, first_column: str) -> list[dict[str, str]]:
    """Return the rows of all Markdown tables whose first column has this header."""
    table_rows: list[dict[str, str]] = []
    header: list[str] = []
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")] if line.startswith("|") else []
        if not cells:
            header = []
        elif not header:
            header = cells if cells[0] == first_column else ["-"]
        elif header[0] == first_column and not set(cells[0]) <= set("-: "):
            table_rows.append(dict(zip(header, cells, strict=True)))
    return table_rows


@cache
def _tables() -> list[dict[str, str]]:
    return rows(PAGE.read_text(encoding="utf-8"), "event")


@cache
def reactions() -> dict[str, dict[str, str]]:
    """Return event -> stage -> "hold", "quick stop", "cut off", "disable", or "" for none."""
    return {row["event"]: row for row in _tables() if "booting" in row}


@cache
def bounds(*, lockstep: bool) -> dict[str, Bound]:
    """Return event -> bound."""
    return {
        row["event"]: Bound(_detection_cycles(row, lockstep=lockstep), int(row["reacts within"]))
        for row in _tables()
        if "seen within" in row
    }


def _detection_cycles(row: dict[str, str], *, lockstep: bool) -> int:
    """Return the cycles of a cell: a number of cycles, ms, heartbeats, or times a machine-file key."""
    text = row["seen within"]
    if lockstep and row["event"] == "inputs missing":
        return 1
    times = max((float(number) for number in re.findall(r"[0-9]+(?:[.][0-9]+)?", text)), default=1.0)
    key = re.search(r"`(?:[a-z]+[.])?([a-z_]+)`", text)
    unit = UNITS[key[1]] if key is not None else HEARTBEAT_CYCLES if "heartbeat" in text else 1
    return math.ceil(times * unit)
