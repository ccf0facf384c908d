"""Options of the operator's bench (docs/operator_page.md), and what they mean for a run."""

from __future__ import annotations

import errno
import importlib.util
import socket
from pathlib import Path
from typing import Annotated

import typer

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.daemon.page_process import PageOptions
from servo_ctrl.hmi.admission import address_of, admission

HmiOption = Annotated[
    str | None,
    typer.Option(
        "--hmi",
        metavar="HOST:PORT",
        help="Serve the operator's bench to browsers at this address (docs/operator_page.md). Without a "
        "program the drives stay off until somebody there enables them.",
    ),
]
AccessOption = Annotated[
    Path | None,
    typer.Option("--hmi-access", help="File of tokens; for any address that others reach, as the next two."),
]
CertificateOption = Annotated[
    Path | None, typer.Option("--hmi-certificate", help="TLS certificate of the page (PEM).")
]
KeyOption = Annotated[Path | None, typer.Option("--hmi-key", help="Key of that certificate (PEM).")]

SocketOption = Annotated[
    Path | None,
    typer.Option(
        "--hmi-socket",
        help="Make the page's socket here, in a directory of this user alone, and start no page: "
        "`python -m servo_ctrl.hmi serve --socket` does, as a service of its own.",
    ),
]


class PageError(ServoCtrlError):
    """The page cannot be served."""


def page_installed() -> bool:
    """Whether the page's library is there."""
    return importlib.util.find_spec("nicegui") is not None


def page_at(
    listen: str,
    access: Path | None = None,
    certificate: Path | None = None,
    key: Path | None = None,
    recordings: Path | None = None,
) -> PageOptions:
    """What serves the page there. Raises ServoCtrlError where that is not possible or not allowed."""
    host, port = address_of(listen)
    admission(host, access, certificate, key)
    if not page_installed():
        raise PageError("--hmi needs the page's library: pip install 'servo-ctrl[hmi]'")
    problem = occupied(host, port)
    if problem:
        raise PageError(f"--hmi {listen}: {problem}")
    arguments = ["--listen", listen]
    files = {"--access": access, "--certificate": certificate, "--key": key, "--recordings": recordings}
    for option, path in files.items():
        if path is not None:
            arguments += [option, str(path.resolve())]
    return PageOptions(tuple(arguments))


def url_of(listen: str, *, tls: bool = False) -> str:
    """As it is typed into a browser."""
    return f"{'https' if tls else 'http'}://{listen}"


def free_address(listen: str) -> str:
    """This address, or one with a free port where that is taken. Raises ServoCtrlError."""
    host, port = address_of(listen)
    if not occupied(host, port):
        return listen
    with _socket(host) as probe:
        probe.bind((host, 0))
        free = probe.getsockname()[1]
    return f"{listen.rpartition(':')[0]}:{free}"


def occupied(host: str, port: int) -> str:
    """Why nobody can listen there, in words; "" when one can."""
    try:
        with _socket(host) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except OSError as error:
        taken = error.errno == errno.EADDRINUSE
        return "somebody listens there already; name another port" if taken else str(error.strerror or error)
    return ""


def _socket(host: str) -> socket.socket:
    return socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
