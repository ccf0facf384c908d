"""At which address the page is served, and who is let in there; without the page's library."""

from __future__ import annotations

import ipaddress
import ssl
from typing import TYPE_CHECKING

from servo_ctrl.config.errors import ConfigError
from servo_ctrl.config.private_file import refuse_readable_for_others
from servo_ctrl.hmi.access import Access, AccessFile

if TYPE_CHECKING:
    from pathlib import Path


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
