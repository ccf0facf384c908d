"""Options of commands that take part programs (G-code), and the program of all its options."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from servo_ctrl.cli.options import read_program
from servo_ctrl.config.load import load_program
from servo_ctrl.config.part_program import ReadingOptions, is_part_program

if TYPE_CHECKING:
    from pathlib import Path

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.config.program_model import ProgramConfig

G54Option = Annotated[
    str | None,
    typer.Option("--g54", help="Work offset of a part program, mm: where its zero is, x=10,y=-2.5."),
]
BlockDeleteOption = Annotated[
    bool, typer.Option("--block-delete", help="Leave out the blocks of a part program that begin with /.")
]


def read_any_program(
    path: Path | None,
    machine: MachineConfig,
    inputs: list[str] | None,
    g54: str | None,
    *,
    block_delete: bool,
) -> ProgramConfig | None:
    """The program of the options, TOML or G-code. Raises ConfigError and typer.BadParameter."""
    if path is None or not is_part_program(path):
        for value, name in ((g54, "--g54"), (block_delete, "--block-delete")):
            if value:
                raise typer.BadParameter("is for part programs (docs/part_programs.md)", param_hint=name)
        return read_program(path, machine, inputs)
    return load_program(path, machine, reading=ReadingOptions(_offset_mm(g54), block_delete))


def _offset_mm(text: str | None) -> dict[str, float]:
    """`x=10,y=-2.5` as numbers. Raises typer.BadParameter."""
    found: dict[str, float] = {}
    for part in text.split(",") if text is not None else ():
        axis, separator, number = (piece.strip() for piece in part.partition("="))
        try:
            value = float(number)
        except ValueError:
            value = float("nan")
        if not (axis and separator and abs(value) < 1e6) or axis in found:
            raise typer.BadParameter(f'"{text}" is not of the kind x=10,y=-2.5', param_hint="--g54")
        found[axis] = value
    return found
