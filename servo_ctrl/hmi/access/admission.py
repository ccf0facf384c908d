"""Checks where the page may listen and with which files, before NiceGUI is imported."""

import ipaddress
import ssl
from pathlib import Path

from servo_ctrl.errors import ConfigError
from servo_ctrl.files.private_file import refuse_readable_for_others
from servo_ctrl.hmi.access.users import Access

OPTION_OF_RUN = "--hmi"
"""What a user of `servo-ctrl` types for the address; the files' options begin alike there."""


def address_of(listen: str, option: str = "--listen") -> tuple[str, int]:
    """Split `HOST:PORT` or `[V6]:PORT` into host and port. Raises ConfigError, which names the `option`."""
    host, separator, port = listen.rpartition(":")
    host = host.removeprefix("[").removesuffix("]") if host.startswith("[") else host
    if not separator or not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise ConfigError(option, listen, "give it as HOST:PORT, with a port from 1 to 65535")
    return host, int(port)


def is_loopback(host: str) -> bool:
    """Whether only this computer reaches the address; of names, only localhost is trusted to be loopback."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def load_access(
    host: str, access: Path | None, certificate: Path | None, key: Path | None, option: str = "--listen"
) -> Access:
    """Return who may log in here. Raises ConfigError where others reach it without TLS or tokens."""
    prefix = f"{OPTION_OF_RUN}-" if option == OPTION_OF_RUN else "--"
    given = {f"{prefix}access": access, f"{prefix}certificate": certificate, f"{prefix}key": key}
    missing = [name for name, path in given.items() if path is None]
    if len(missing) == len(given) and is_loopback(host):
        return Access()
    if access is None or certificate is None or key is None:
        need = "is reached from elsewhere, which" if not is_loopback(host) else "with one of them"
        names = " and ".join(", ".join(given).rsplit(", ", 1))
        raise ConfigError(option, host, f"{need} needs {names}: {', '.join(missing)} missing")
    refuse_readable_for_others(key)
    visitors = Access(access)
    if not visitors.owners():
        raise ConfigError(
            access, "", "there is no token in it; make one: python -m servo_ctrl.hmi token NAME ROLE"
        )
    check_certificate(certificate, key)
    return visitors


def check_certificate(certificate: Path, key: Path) -> None:
    """Refuse what the server could not use, before it starts. Raises ConfigError."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(certificate, key, password=_no_passphrase)
    except (OSError, ssl.SSLError, ValueError) as error:
        raise ConfigError(certificate, "", f"no certificate with its key: {error}") from None


def _no_passphrase() -> str:
    raise ValueError("the key is encrypted")
