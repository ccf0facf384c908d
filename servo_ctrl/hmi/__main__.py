"""`python -m servo_ctrl.hmi`: the page's process, and the tokens of its access file."""

from __future__ import annotations

import ipaddress
import ssl
from pathlib import Path
from typing import Annotated, Literal

import typer

from servo_ctrl.config.errors import ConfigError, ServoCtrlError
from servo_ctrl.config.private_file import refuse_readable_for_others
from servo_ctrl.hmi.access import (
    ROLES,
    Access,
    AccessFile,
    add_token,
    remove_token,
)

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


def address_of(listen: str) -> tuple[str, int]:
    """Host and port of `HOST:PORT` or `[V6]:PORT`. Raises ConfigError."""
    host, separator, port = listen.rpartition(":")
    host = host.removeprefix("[").removesuffix("]") if host.startswith("[") else host
    if not separator or not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise ConfigError("--listen", listen, "give it as HOST:PORT, with a port from 1 to 65535")
    return host, int(port)


def is_loopback(host: str) -> bool:
    """Reached from this machine only; a name other than localhost is not trusted to be."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def admission(host: str, access: Path | None, certificate: Path | None, key: Path | None) -> Access:
    """Whom to let in at this address. Raises ConfigError where others reach it without TLS and tokens."""
    given = {"--access": access, "--certificate": certificate, "--key": key}
    missing = [option for option, path in given.items() if path is None]
    if len(missing) == len(given) and is_loopback(host):
        return Access()
    if missing:
        need = "is reached from elsewhere, which" if not is_loopback(host) else "with one of them"
        raise ConfigError(
            "--listen", host, f"{need} needs --access, --certificate and --key: {', '.join(missing)} missing"
        )
    assert access is not None and certificate is not None and key is not None  # noqa: S101, PT018  # nothing is missing
    refuse_readable_for_others(key)
    file = AccessFile(access)
    if not file.entries():
        raise ConfigError(
            access, "", "there is no token in it; make one: python -m servo_ctrl.hmi token NAME ROLE"
        )
    check_certificate(certificate, key)
    return Access(file)


def check_certificate(certificate: Path, key: Path) -> None:
    """Refuse what the server could not use, before it starts. Raises ConfigError."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(certificate, key, password=_no_passphrase)
    except (OSError, ssl.SSLError, ValueError) as error:
        raise ConfigError(certificate, "", f"no certificate with its key: {error}") from None


def _no_passphrase() -> str:
    raise ValueError("the key is encrypted")


def main() -> None:
    """Errors are one line on standard error."""
    try:
        cli()
    except ServoCtrlError as error:
        typer.echo(f"error: {error}", err=True)
        raise SystemExit(1) from None


if __name__ in {"__main__", "__mp_main__"}:
    main()
