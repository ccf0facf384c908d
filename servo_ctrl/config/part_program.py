"""A part program (G-code) as motion knows it, and what was noticed while it was read."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from servo_ctrl.motion.program import Step

SUFFIXES = frozenset({".ngc", ".nc", ".gcode", ".tap", ".cnc"})
"""File names that end so are part programs, in upper or lower case."""


class Remark(NamedTuple):
    """Something in the text that a person should know before it runs."""

    line: int
    word: str
    text: str


@dataclass(frozen=True, slots=True)
class ReadingOptions:
    """What a part program leaves to the machine."""

    work_offset_mm: Mapping[str, float] = field(default_factory=dict)
    """G54: where the program's zero is, per axis; 0 without it."""
    block_delete: bool = False
    """Leave out the blocks that begin with /."""


@dataclass(frozen=True, slots=True)
class PartProgram:
    """The counterpart of `ProgramConfig`: `steps` are paths and dwells, from one rest to the next."""

    source: Path
    steps: Sequence[Step]
    remarks: Sequence[Remark]
    blocks: int
    """Lines with words, up to the end of the program."""
    work_offset_m: Mapping[str, float]


def is_part_program(path: Path) -> bool:
    """Whether the file's name says that it is G-code."""
    return path.suffix.lower() in SUFFIXES
