"""Part programs read from their text, and the elements of their paths."""

from collections.abc import Callable
from pathlib import Path

from servo_ctrl.config.part_program import PartProgram, ReadingOptions
from servo_ctrl.config.part_program_reader import read_part_program
from servo_ctrl.motion.path.path_move import Element, PathMove

Read = Callable[..., PartProgram]

MM = 1e-3


def reader(folder: Path) -> Read:
    """Reads a text, on the axes x and y where no others are named."""
    path = folder / "part.ngc"

    def make(text: str, axes: str = "xy", **options: object) -> PartProgram:
        path.write_text(text, encoding="utf-8")
        return read_part_program(path, list(axes), ReadingOptions(**options))  # type: ignore[arg-type]

    return make


def elements(program: PartProgram) -> list[Element]:
    return [element for step in program.motion if isinstance(step, PathMove) for element in step.elements]


def ends_mm(program: PartProgram) -> list[tuple[float, ...]]:
    return [tuple(round(value / MM, 9) for value in element.shape.end_m) for element in elements(program)]
