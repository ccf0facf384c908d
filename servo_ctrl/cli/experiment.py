"""`servo-ctrl experiment`: the installed studies, found by entry points; imports only the one to run."""

from typing import Any

import typer
from typer.main import get_command

from shipped_files.plain_help import PlainCommand, PlainGroup

GROUP = "servo_ctrl.studies"
"""Entry points `name = module:function` of this group; each function is a typer command."""


class Studies(PlainGroup):
    """A group whose commands are entry points: `experiment NAME` imports only the module of NAME."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002  # the group's signature
        """Return the names of the installed studies."""
        return sorted(_entry_points().names)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command of a study; None if there is no study of this name."""
        if cmd_name not in self.list_commands(ctx):
            return None
        study = typer.Typer(add_completion=False, rich_markup_mode=self.rich_markup_mode)
        study.command(cmd_name, cls=PlainCommand)(_entry_points()[cmd_name].load())
        return get_command(study)


app = typer.Typer(cls=Studies, no_args_is_help=True)


@app.callback()
def experiments() -> None:
    """Hold simulated machines against published and measured figures, over the bus in lockstep."""


def _entry_points() -> Any:
    from importlib.metadata import entry_points

    return entry_points(group=GROUP)
