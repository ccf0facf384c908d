"""`python -m servo_ctrl.hmi`: serves the operator's bench, and manages the tokens of its access file."""

import logging
from pathlib import Path
from typing import Annotated, Literal

import typer

from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.hmi.access.admission import address_of, load_access
from servo_ctrl.hmi.access.users import ROLES, add_token, remove_token

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
    language: Annotated[
        Literal["en", "de"] | None,
        typer.Option(help="Language of the pages until a visitor picks another; without it the browser's."),
    ] = None,
) -> None:
    """Serve the operator's bench; `servo-ctrl run --hmi` starts this by itself."""
    # NiceGUI takes a second to import, for which making a token need not wait
    from servo_ctrl.hmi import app  # noqa: PLC0415
    from servo_ctrl.hmi.access.control_right import ControlRight  # noqa: PLC0415
    from servo_ctrl.hmi.link.machine_link import MachineLink  # noqa: PLC0415
    from servo_ctrl.hmi.shell.open_page import PageServices  # noqa: PLC0415

    logging.basicConfig(format="%(message)s")
    logging.getLogger("servo_ctrl").setLevel(logging.INFO)  # log-ins with their addresses
    host, port = address_of(listen)
    visitors = load_access(host, access, certificate, key)
    link, control = MachineLink(socket), ControlRight()
    services = PageServices(
        link=link,
        access=visitors,
        control=control,
        recordings=recordings.resolve(),
        programs=programs,
        language=language,
    )
    app.serve(services, host, port, certificate, key)


@cli.command()
def token(
    name: Annotated[str, typer.Argument(help="Who will have it; one token a name.")],
    role: Annotated[Literal["view", "operate", "configure"], typer.Argument(help="What they may do.")],
    access: AccessOption = ACCESS_FILE,
) -> None:
    """Make a token and show it, once. Only its hash is kept; a token that NAME had before is void."""
    new = add_token(access, name, ROLES[role])
    typer.echo(f"{access}: {name} may {role}. This is shown once:", err=True)
    typer.echo(new)


@cli.command()
def revoke(
    name: Annotated[str, typer.Argument(help="Whose token.")], access: AccessOption = ACCESS_FILE
) -> None:
    """Revoke a token; the sessions that were opened with it end at once."""
    remove_token(access, name)
    typer.echo(f"{access}: {name} is out")


def main() -> None:
    """Run the command; an error is one line on standard error."""
    try:
        cli()
    except ServoCtrlError as error:
        typer.echo(f"error: {error}", err=True)
        raise SystemExit(1) from None


if __name__ in {"__main__", "__mp_main__"}:
    main()
