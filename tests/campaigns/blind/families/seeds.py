"""Which seeds of a family have been looked at: a committed list, so no case counts as unseen twice."""

import fcntl
import json
import os
from pathlib import Path

FILE = Path(__file__).with_name("used_seeds.json")
FIRST_SCORED = 10_000
"""First seed of scored cases; chosen. Seeds below are for training and are never a proof."""
FAMILIES = ("ball_screw", "belt_drive", "linear_motor", "rack_and_pinion", "robot_joint")
KEPT_OUT = ("tilting_table",)
"""Families kept for a check: none of their cases is fitted or developed on, or in the published tables."""


def used(file: Path = FILE) -> dict[str, list[list[int]]]:
    """Return by family the ranges of seeds that were scored, first and last of each."""
    ranges: dict[str, list[list[int]]] = json.loads(file.read_text(encoding="utf-8"))
    return ranges


def first_fresh(family: str, file: Path = FILE) -> int:
    """Return the first seed above all that were scored."""
    return max([FIRST_SCORED, *(last + 1 for _, last in used(file).get(family, []))])


def claim(family: str, first: int, count: int, file: Path = FILE) -> bool:
    """Write down that these seeds are looked at now; return whether they may be scored.

    Raises:
        ValueError: some were looked at before, or the range is of both sorts.
    """
    last = first + count - 1
    if last < FIRST_SCORED:
        return False
    if first < FIRST_SCORED:
        raise ValueError(f"seeds {first} to {last} are of both sorts: training ends at {FIRST_SCORED - 1}")
    directory = os.open(file.parent, os.O_RDONLY)
    try:
        fcntl.flock(directory, fcntl.LOCK_EX)  # against trials that run side by side
        _claim(family, first, last, file)
    finally:
        os.close(directory)
    return True


def _claim(family: str, first: int, last: int, file: Path) -> None:
    ranges = used(file)
    for a, b in ranges.get(family, []):
        if first <= b and a <= last:
            raise ValueError(f"{family}: seeds {a} to {b} are used; begin at {first_fresh(family, file)}")
    ranges[family] = sorted([*ranges.get(family, []), [first, last]])
    temporary = file.with_suffix(".tmp")
    temporary.write_text(json.dumps(ranges, indent=1) + "\n", encoding="utf-8")
    temporary.replace(file)  # whoever reads meanwhile sees all or nothing


def fresh_words() -> str:
    """Return a line a family: where its fresh seeds begin."""
    return "; ".join(f"{family} from {first_fresh(family)}" for family in (*FAMILIES, *KEPT_OUT))
