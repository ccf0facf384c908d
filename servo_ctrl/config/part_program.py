"""A part program (G-code) as motion knows it, and what was noticed while it was read."""

from collections.abc import (
    Mapping,
    Sequence,  # pydantic resolves the annotation
)
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import Field, SkipValidation

from servo_ctrl.config.program_model import ProgramConfig, StepConfig
from servo_ctrl.motion.gcode.path_builder import Modes  # pydantic resolves the annotation

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
    work_offsets_m: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Those that are set, G54 to G59, per axis; `work_offset_mm` goes before."""
    first_line: int = 1
    """Where the motion begins: with what the lines before it set, and where they end."""
    modes: Modes | None = None
    """What holds at the start, of a line that goes on from another one."""
    start_m: Sequence[float] | None = None
    """Where the axes stand, of such a line: in machine order."""


class ProgramEntry(NamedTuple):
    """What holds where a program is entered at a line behind its first."""

    line: int
    words: str
    """The modal words, as "G1 G17 G21 G90 G94 G54 F600"."""
    position_m: tuple[float, ...]
    """Where the axes go first, in machine order; NaN = an axis stays where it is."""


class PartProgram(ProgramConfig):
    """A program from G-code: it has no steps of its own kind, they are paths and dwells already."""

    steps: list[StepConfig] = Field(default_factory=list, alias="step", max_length=0)
    motion: SkipValidation[Sequence[Any]]  # Step of motion/program.py, which pydantic cannot look into
    """Paths and dwells, from one rest to the next, SI."""
    remarks: SkipValidation[Sequence[Remark]]
    blocks: int
    """Lines with words, up to the end of the program."""
    work_offset_m: dict[str, float]
    """G54, per axis."""
    optional_stops: SkipValidation[Sequence[int]] = ()
    """Lines with M1."""
    entry: SkipValidation[ProgramEntry | None] = None
    """Where the reading began behind the first line."""
    modes: SkipValidation[Modes | None] = None
    """What holds at its end."""
    start_m: SkipValidation[Sequence[float] | None] = None
    """Where the axes stand, of a line that was read from there."""


def is_part_program(path: Path) -> bool:
    """Whether the file's name says that it is G-code."""
    return path.suffix.lower() in SUFFIXES
