"""Declarations of options that several subcommands share; `option_values` interprets their values."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

import typer

from shipped_files import shipped, shipped_or_none


class PacingChoice(StrEnum):
    """What starts a cycle: the clock, or the inputs of the previous cycle."""

    REALTIME = "realtime"
    LOCKSTEP = "lockstep"


class LearnedKind(StrEnum):
    """Kind of learned result: friction pulse, error table and lost motion of the screw, or waveform."""

    PULSE = "pulse"
    SCREW = "screw"
    WAVEFORM = "waveform"


MachineOption = Annotated[
    Path,
    typer.Option(
        help="Machine directory with controller.toml, or the file itself; or a shipped machine: xy_table.",
        show_default=False,
        callback=shipped,
    ),
]
ProgramOption = Annotated[
    Path | None,
    typer.Option(help="Program file (TOML, G-code). Without it the axes are held.", callback=shipped_or_none),
]
InputOption = Annotated[
    list[str] | None,
    typer.Option("--input", help="NAME=FILE for a program's step that names an input; may be repeated."),
]
G54Option = Annotated[
    str | None,
    typer.Option("--g54", help="Work offset of a part program, mm: where its zero is, x=10,y=-2.5."),
]
BlockDeleteOption = Annotated[
    bool, typer.Option("--block-delete", help="Leave out the blocks of a part program that begin with /.")
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
    Path | None, typer.Option(help="Directory for the recording (docs/recordings.md); must not hold one yet.")
]
FifoOption = Annotated[
    bool, typer.Option("--fifo", help="SCHED_FIFO and locked memory; needs permission (root, or limits).")
]
LearnedOption = Annotated[
    Path | None,
    typer.Option(help='Directory of the learned functions; without it "learned" beside the machine file.'),
]
LearnedKindOption = Annotated[
    LearnedKind, typer.Option("--kind", help="Friction pulse, waveform, or screw error and lost motion.")
]
ServeOption = Annotated[
    bool, typer.Option("--serve", help="Hold the axes after the program and take commands (SDO, MQTT).")
]
NoCompensationOption = Annotated[
    bool,
    typer.Option("--no-compensation", help="Without pulse, observer, screw table and sampled dual loop."),
]
ObserverOption = Annotated[
    bool, typer.Option("--observer", help="The disturbance observer acts instead of the learned pulse.")
]
HmiOption = Annotated[
    str | None,
    typer.Option(
        metavar="HOST:PORT",
        help="Serve the operator's bench to browsers at this address (docs/operator_page.md). Without a "
        "program the drives stay off until somebody there enables them.",
    ),
]
HmiAccessOption = Annotated[
    Path | None, typer.Option(help="File of tokens; for any address that others reach, as the next two.")
]
HmiLanguageOption = Annotated[
    Literal["en", "de"] | None,
    typer.Option(help="Language of the page until a visitor picks another; without it the browser's."),
]
HmiCertificateOption = Annotated[Path | None, typer.Option(help="TLS certificate of the page (PEM).")]
HmiKeyOption = Annotated[Path | None, typer.Option(help="Key of that certificate (PEM).")]
HmiSocketOption = Annotated[
    Path | None,
    typer.Option(
        help="Make the page's socket here, in a directory of this user alone, and start no page: "
        "`python -m servo_ctrl.hmi serve --socket` does, as a service of its own."
    ),
]
MqttOption = Annotated[
    str | None,
    typer.Option(
        help="HOST[:PORT] of the MQTT broker (docs/mqtt.md), instead of the machine file's; the rest of "
        "its section stays."
    ),
]


class ProgressFormat(StrEnum):
    """`--progress`."""

    TEXT = "text"
    JSON = "json"


OutOption = Annotated[Path, typer.Option(help="Folder for pictures and recordings; made if absent.")]
TableOption = Annotated[
    Path,
    typer.Option(
        help="Directory of the X-Y table with controller.toml, plant.toml and programs/.", callback=shipped
    ),
]
JsonOption = Annotated[Path | None, typer.Option("--json", help="Write the figures to this file.")]
