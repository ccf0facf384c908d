"""`python -m servo_ctrl.hmi`: the page's process, and the tokens of its access file."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Annotated, Literal

import typer

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.hmi.access import ROLES, add_token, remove_token
from servo_ctrl.hmi.admission import address_of, admission

ACCESS_FILE = Path("hmi_access.toml")
cli = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
AccessOption = Annotated[Path, typer.Option("--access", help="Access file.")]


@cli.command()
def serve(
    socket: Annotated[Path, typer.Option(help="Local socket of the control process.")],
    listen: Annotated[str, typer.Option(help="HOST:PORT for browsers.")] = "127.0.0.1:8080",
    access: Annotated[
        Path | None, typer.Option(help="Access file; needed for any other than loopback.")
    ] = None,
    certificate: Annotated[Path | None, typer.Option(help="TLS certificate (PEM), with its chain.")] = None,
    key: Annotated[
        Path | None, typer.Option(help="Key of the certificate (PEM), for its owner only.")
    ] = None,
    recordings: Annotated[Path, typer.Option(help="Where captures of the page go.")] = Path("out"),
    programs: Annotated[
        Path | None, typer.Option(help="Motion programs; without it, programs beside the machine file.")
    ] = None,
) -> None:
    """Serve the operator's bench; `servo-ctrl run --hmi` starts this by itself."""
    # the page's library takes a second to import, which making a token need not wait for
    from servo_ctrl.hmi import app  # noqa: PLC0415
    from servo_ctrl.hmi.bench import Bench, Directories  # noqa: PLC0415
    from servo_ctrl.hmi.control_right import ControlRight  # noqa: PLC0415
    from servo_ctrl.hmi.machine_link import MachineLink  # noqa: PLC0415

    logging.basicConfig(format="%(message)s")
    logging.getLogger("servo_ctrl").setLevel(logging.INFO)  # who has logged in from where
    host, port = address_of(listen)
    known = admission(host, access, certificate, key)
    bench = Bench(MachineLink(socket), known, ControlRight(), Directories(recordings.resolve(), programs))
    app.serve(bench, app.Listening(host, port, certificate, key))


@cli.command()
def token(
    name: Annotated[str, typer.Argument(help="Who will have it; one token a name.")],
    role: Annotated[Literal["view", "operate", "configure"], typer.Argument(help="What they may do.")],
    access: AccessOption = ACCESS_FILE,
) -> None:
    """Make a token and show it, once. Only its hash is kept; a token that NAME had before is void."""
    made = add_token(access, name, ROLES[role])
    typer.echo(f"{access}: {name} may {role}. This is shown once:", err=True)
    typer.echo(made)


@cli.command()
def revoke(
    name: Annotated[str, typer.Argument(help="Whose token.")], access: AccessOption = ACCESS_FILE
) -> None:
    """Take a token away; whoever is logged in with it is out at once."""
    remove_token(access, name)
    typer.echo(f"{access}: {name} is out")


def main() -> None:
    """Errors are one line on standard error."""
    try:
        cli()
    except ServoCtrlError as error:
        typer.echo(f"error: {error}", err=True)
        raise SystemExit(1) from None


if __name__ in {"__main__", "__mp_main__"}:
    main()
