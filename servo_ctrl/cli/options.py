"""Options that several subcommands share, and how their values are read."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from servo_ctrl.config.load import load_program
from servo_ctrl.config.mqtt_model import MqttConfig

if TYPE_CHECKING:
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.config.program_model import ProgramConfig


class PacingChoice(StrEnum):
    """What starts a cycle."""

    REALTIME = "realtime"
    LOCKSTEP = "lockstep"


MachineOption = Annotated[
    Path, typer.Option(help="Machine directory with controller.toml, or the file itself.", show_default=False)
]
ProgramOption = Annotated[
    Path | None, typer.Option(help="Program file (TOML, G-code). Without it the axes are held.")
]
InputOption = Annotated[
    list[str] | None,
    typer.Option("--input", help="NAME=FILE for a program's step that names an input; may be repeated."),
]
BusOption = Annotated[
    str,
    typer.Option(
        help="INTERFACE:CHANNEL of python-can: socketcan:can0, socketcan:vcan0, localcan:/tmp/bus.sock.",
        show_default=False,
    ),
]
PacingOption = Annotated[
    PacingChoice,
    typer.Option(
        help="realtime: a SYNC every period by the clock. lockstep: the next SYNC once all inputs are in "
        "(for a simulator that takes its time from SYNC)."
    ),
]
RecordOption = Annotated[
    Path | None,
    typer.Option(help="Directory for the recording (docs/recordings.md); must not hold one yet."),
]
FifoOption = Annotated[
    bool, typer.Option("--fifo", help="SCHED_FIFO and locked memory; needs permission (root, or limits).")
]
LearnedOption = Annotated[
    Path | None,
    typer.Option(help='Directory of the learned functions; without it "learned" beside the machine file.'),
]
MqttOption = Annotated[
    str | None,
    typer.Option(
        help="HOST[:PORT] of the MQTT broker (docs/mqtt.md), instead of the machine file's; the rest of "
        "its section stays."
    ),
]
OutOption = Annotated[Path, typer.Option(help="Folder for pictures and recordings; made if absent.")]
TableOption = Annotated[
    Path, typer.Option(help="Directory of the X-Y table with controller.toml, plant.toml and programs/.")
]


def read_program(path: Path | None, machine: MachineConfig, inputs: list[str] | None) -> ProgramConfig | None:
    """The program of the options. Raises ConfigError, and typer.BadParameter for an ill-formed --input."""
    files = {}
    for text in inputs or []:
        name, separator, file = text.partition("=")
        if not (name and separator and file):
            raise typer.BadParameter(f'"{text}" is not NAME=FILE', param_hint="--input")
        files[name] = Path(file)
    return load_program(path, machine, files) if path is not None else None


def with_broker(machine: MachineConfig, address: str | None) -> MachineConfig:
    """The machine with its broker at the address of --mqtt, if there is one. Raises typer.BadParameter.

    Who logs in and how the connection is secured stays what the machine file says.
    """
    if address is None:
        return machine
    try:
        broker = (machine.mqtt or MqttConfig()).at(address)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--mqtt") from None
    return machine.model_copy(update={"mqtt": broker})
