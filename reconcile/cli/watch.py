"""`reconcile watch`: compares every new recording of a machine with the earlier ones."""

from pathlib import Path
from typing import Annotated

import typer

from reconcile.cli.options import MappingOption

FolderArgument = Annotated[
    Path, typer.Argument(metavar="DIR", help="Where the recordings arrive: one file or directory each.")
]
ModelOption = Annotated[Path, typer.Option(help="Model of the machine: a plant.toml, or a model.toml.")]
OutOption = Annotated[Path, typer.Option(help="Directory for watch.json and watch.html.")]
AxisOption = Annotated[
    list[str] | None, typer.Option(help="Watch this axis only; may be repeated. Default: all.")
]
OnceOption = Annotated[bool, typer.Option("--once", help="End after the recordings that are there.")]
PollOption = Annotated[
    float, typer.Option("--poll", min=0.2, max=3600.0, help="Time between two looks for new ones, seconds.")
]
RunLengthOption = Annotated[
    float,
    typer.Option(
        "--false-alarms", min=10.0, max=1e6, help="Least mean number of recordings between false alarms."
    ),
]
DiagnoseOption = Annotated[
    bool, typer.Option("--diagnose/--no-diagnose", help="Name what has changed by two diagnoses.")
]
MqttOption = Annotated[
    str | None, typer.Option(metavar="HOST[:PORT]", help="Publish changes to this MQTT broker.")
]
MachineOption = Annotated[
    Path | None,
    typer.Option(help="The controller's machine directory: its [mqtt] section and name for the topics."),
]


def watch(
    folder: FolderArgument,
    model: ModelOption,
    out: OutOption = Path("out/watch"),
    axis: AxisOption = None,
    mapping: MappingOption = None,
    once: OnceOption = False,
    poll_s: PollOption = 5.0,
    run_length: RunLengthOption = 1000.0,
    diagnose: DiagnoseOption = True,
    mqtt: MqttOption = None,
    machine: MachineOption = None,
) -> None:
    """Find when, where and how a machine starts to differ from its model: wear, lubrication, play.

    Each recording is condensed into a few indicators, each with its own interval: friction, moved mass, lost
    motion, waves of the screw, unexplained residual. From the eighth recording on each one is compared with
    those before it, similar motions with each other. After an alarm: when the change began, in a step or
    gradually, the values before and after, and what physics it is.

        servo-ctrl run --machine machines/xy_table ... --record runs/2026-11-21
        reconcile watch runs --model machines/xy_table/plant.toml --out out/watch

    Without --once it waits for new recordings until Ctrl-C; started again, it goes on where it was. Half
    written recordings are left alone. With --mqtt or --machine each change is published, retained, as
    servo_ctrl/MACHINE/axis/NAME/change.

    Exit codes: 0 ended by --once, or by Ctrl-C while it waited, changed or not; 1 a file cannot be used, and
    standard error says which, where and why; 2 wrong use of the command; 130 Ctrl-C while it read, with no
    file half written.
    """
    from reconcile.cli.watch_session import WatchSession
    from reconcile.formats.mapping import parse_mapping
    from reconcile.watch.watch import Watch, WatchOptions

    options = WatchOptions(tuple(axis or ()), run_length, diagnose, parse_mapping(mapping or []))
    session = WatchSession(Watch(folder, model, out, options), mqtt, machine)
    session.read_new(wait_for_unfinished=once)
    session.print_summary(out)
    if not once:
        session.follow(folder, poll_s)
