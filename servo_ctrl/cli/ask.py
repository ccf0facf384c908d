"""`servo-ctrl ask`: commands to a running controller, and its status, by SDO over the bus."""

from typing import Annotated

import typer

from servo_ctrl.cli.options import BusOption, MachineOption
from servo_ctrl.commands.command import Command

COMMAND_HELP = (
    f"One of {', '.join(command.word for command in Command)}; set required-um NUMBER, set learner "
    "fast|paper|screw, set adaptation on|off; status; watch (until learning ends). enable, disable and "
    "roll-back are for the friction compensation, switch-on and switch-off for the drives."
)


def ask(
    machine: MachineOption,
    bus: BusOption,
    words: Annotated[list[str], typer.Argument(metavar="COMMAND", help=COMMAND_HELP, show_default=False)],
    axis: Annotated[str, typer.Option(help="Axis the command is for. Without it: all.")] = "",
    json: Annotated[bool, typer.Option("--json", help="Print the status as JSON.")] = False,
) -> None:
    """Give a running controller a command, or read its status, over the bus.

    Exits with 0 when the controller accepted, 1 when not. docs/commands.md has the objects behind it.

    Example: `servo-ctrl ask --machine machines/xy_table --bus socketcan:vcan0 start-learning --axis x`
    """
    import asyncio

    from servo_ctrl.cli.ask_request import parse_request, perform
    from servo_ctrl.config.load import load_machine

    config = load_machine(machine)
    request = parse_request(words, axis, list(config.axes))
    asyncio.run(perform(request, config, bus, json=json))
