"""Address and process of the operator's page (docs/operator_page.md), by the options of a run."""

import errno
import importlib.util
import socket
from pathlib import Path

from servo_ctrl.daemon.page.page_process import PageOptions
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.hmi.access.admission import OPTION_OF_RUN as OPTION
from servo_ctrl.hmi.access.admission import address_of, load_access


class PageError(ServoCtrlError):
    """The page cannot be served."""


def page_installed() -> bool:
    """Whether the page's library is installed."""
    return importlib.util.find_spec("nicegui") is not None


def page_at(
    listen: str,
    access: Path | None = None,
    certificate: Path | None = None,
    key: Path | None = None,
    recordings: Path | None = None,
    language: str | None = None,
) -> PageOptions:
    """Return the options of the process that serves the page at `listen`.

    Raises ServoCtrlError where the page cannot be served, or must not without access control.
    """
    host, port = address_of(listen, OPTION)
    load_access(host, access, certificate, key, OPTION)
    if not page_installed():
        raise PageError("--hmi needs the page's library: pip install 'servo-ctrl[hmi]'")
    if problem := occupied(host, port):
        raise PageError(f"--hmi {listen}: {problem}")
    arguments = ["--listen", listen]
    files = {"--access": access, "--certificate": certificate, "--key": key, "--recordings": recordings}
    for option, path in files.items():
        if path is not None:
            arguments += [option, str(path.resolve())]
    if language is not None:
        arguments += ["--language", language]
    return PageOptions(tuple(arguments))


def url_of(listen: str, *, tls: bool = False) -> str:
    """Return the URL of the address."""
    return f"{'https' if tls else 'http'}://{listen}"


def free_address(listen: str) -> str:
    """Return `listen`, or the same host with a free port if the port is taken. Raises ServoCtrlError."""
    host, port = address_of(listen, OPTION)
    if not occupied(host, port):
        return listen
    with _socket(host) as probe:
        probe.bind((host, 0))
        free = probe.getsockname()[1]
    return f"{listen.rpartition(':')[0]}:{free}"


def occupied(host: str, port: int) -> str:
    """Return why no process can listen there, or ""."""
    try:
        with _socket(host) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except OSError as error:
        taken = error.errno == errno.EADDRINUSE
        return "another program listens there; name another port" if taken else str(error.strerror or error)
    return ""


def _socket(host: str) -> socket.socket:
    return socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
