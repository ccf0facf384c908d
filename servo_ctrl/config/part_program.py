"""A part program (G-code) as motion, with the remarks of the reader."""

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
"""Suffixes of part programs, in upper or lower case."""


class Remark(NamedTuple):
    """A remark of the reader that the user should see before the program runs."""

    line: int
    word: str
    text: str


@dataclass(frozen=True, slots=True)
class ReadingOptions:
    """Options for reading a part program that it does not contain itself."""

    work_offset_mm: Mapping[str, float] = field(default_factory=dict)
    """G54: position of the program's zero by axis; 0 without it."""
    block_delete: bool = False
    """Whether to skip blocks that begin with /."""
    work_offsets_m: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Offsets G54 to G59 that are set, by axis; `work_offset_mm` has priority."""
    first_line: int = 1
    """Line where the motion begins, in the modal state and position after the lines before it."""
    modes: Modes | None = None
    """Modal state at the start of a single line of G-code."""
    start_m: Sequence[float] | None = None
    """Positions at the start of a single line, in machine order."""


class ProgramEntry(NamedTuple):
    """The state where a program is entered at a line after its first."""

    line: int
    words: str
    """The modal words, such as "G1 G17 G21 G90 G94 G54 F600"."""
    position_m: tuple[float, ...]
    """The approach position, in machine order; NaN = the axis holds its position."""


class PartProgram(ProgramConfig):
    """A program from G-code, whose steps are already paths and dwells."""

    steps: list[StepConfig] = Field(default_factory=list, alias="step", max_length=0)
    motion: SkipValidation[Sequence[Any]]  # Step of motion/program.py, which pydantic cannot check
    """Paths and dwells, each from rest to rest, SI."""
    remarks: SkipValidation[Sequence[Remark]]
    blocks: int
    """Lines with words, up to the end of the program."""
    work_offset_m: dict[str, float]
    """G54 by axis."""
    optional_stops: SkipValidation[Sequence[int]] = ()
    """Lines with M1."""
    entry: SkipValidation[ProgramEntry | None] = None
    """Where the motion begins, if not at the first line."""
    modes: SkipValidation[Modes | None] = None
    """Modal state at its end."""
    start_m: SkipValidation[Sequence[float] | None] = None
    """Positions at the start, for a single line."""


def is_part_program(path: Path) -> bool:
    """Whether the suffix of a file says that it is G-code."""
    return path.suffix.lower() in SUFFIXES
