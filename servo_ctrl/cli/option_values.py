"""Values of the shared options: the program with its inputs and work offset, the MQTT broker."""

from collections.abc import Sequence
from pathlib import Path

import typer

from servo_ctrl.config.load import load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.config.part_program import ReadingOptions, is_part_program
from servo_ctrl.config.program_model import ProgramConfig

OFFSET_LIMIT_MM = 1e6
"""Bounds the digits of --g54: larger than any machine, small enough that micrometres survive in a float."""


def read_program(
    path: Path | None,
    machine: MachineConfig,
    inputs: Sequence[str] | None,
    g54: str | None,
    *,
    block_delete: bool,
) -> ProgramConfig | None:
    """Load the program of the options, TOML or G-code. Raises ConfigError and typer.BadParameter."""
    if path is not None and is_part_program(path):
        return load_program(path, machine, reading=ReadingOptions(_offset_mm(g54), block_delete))
    for value, name in ((g54, "--g54"), (block_delete, "--block-delete")):
        if value:
            raise typer.BadParameter("is for part programs (docs/part_programs.md)", param_hint=name)
    files = _input_files(inputs or ())
    return load_program(path, machine, files) if path is not None else None


def _input_files(inputs: Sequence[str]) -> dict[str, Path]:
    """Read `NAME=FILE` options. Raises typer.BadParameter."""
    files = {}
    for text in inputs:
        name, separator, file = text.partition("=")
        if not (name and separator and file):
            raise typer.BadParameter(f'"{text}" is not NAME=FILE', param_hint="--input")
        files[name] = Path(file)
    return files


def _offset_mm(text: str | None) -> dict[str, float]:
    """Read `x=10,y=-2.5` as millimetres by axis. Raises typer.BadParameter."""
    offset_mm: dict[str, float] = {}
    for part in text.split(",") if text is not None else ():
        axis, separator, number = (piece.strip() for piece in part.partition("="))
        try:
            value_mm = float(number)
        except ValueError:
            value_mm = float("nan")
        if not (axis and separator and abs(value_mm) < OFFSET_LIMIT_MM) or axis in offset_mm:
            raise typer.BadParameter(f'"{text}" is not of the kind x=10,y=-2.5', param_hint="--g54")
        offset_mm[axis] = value_mm
    return offset_mm


def with_broker(machine: MachineConfig, address: str | None) -> MachineConfig:
    """Return the machine with its broker at the address of --mqtt, if given. Raises typer.BadParameter.

    User, password and TLS remain those of the machine file.
    """
    if address is None:
        return machine
    try:
        broker = (machine.mqtt or MqttConfig()).at(address)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--mqtt") from None
    return machine.model_copy(update={"mqtt": broker})
