"""Parses a command line by the program whose it is, without running it."""

from typing import Any

import typer.main

from hil_sim.cli.main import app as hil_sim
from reconcile.cli.main import app as reconcile
from servo_ctrl.cli.main import app as servo_ctrl

PROGRAMS: dict[str, Any] = {
    name: typer.main.get_command(app)
    for name, app in (("servo-ctrl", servo_ctrl), ("hil-sim", hil_sim), ("reconcile", reconcile))
}


def parse(words: list[str]) -> None:
    """Raise click's UsageError where a word is not what the program takes."""
    command: Any = PROGRAMS[words[0]]
    rest, context = words[1:], None
    while hasattr(command, "get_command"):
        context = typer.Context(command, parent=context, info_name=words[0])
        found = command.get_command(context, rest[0])
        assert found is not None, f"{words[0]} has no command {rest[0]}"
        command, rest = found, rest[1:]
    command.make_context(words[0], rest, parent=context, resilient_parsing=False)
