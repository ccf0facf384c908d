"""The socket of a hub, which replaces neither another hub's socket nor a file of another kind."""

import errno
import os
import socket
import stat
import struct
from collections.abc import Iterable
from pathlib import Path

_CREDENTIALS = struct.Struct("@iII")  # struct ucred of Linux's unix(7)
_BACKLOG = 64  # bounds the connections that wait to be accepted (chosen)


class HubError(Exception):
    """No hub is possible at that path."""


class HubPresentError(HubError):
    """Another hub serves the path already."""


def peer_pids(connections: Iterable[socket.socket]) -> list[int]:
    """Return the process ids at the other ends of connected sockets, without those of another namespace."""
    credentials = (
        sock.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size) for sock in connections
    )
    return [pid for pid, _user, _group in map(_CREDENTIALS.unpack, credentials) if pid]


def listen_at(path: Path) -> socket.socket:
    """Make a socket at `path`, mode 0600, which appears there only once it listens."""
    temporary = path.with_name(f"{path.name}.{os.getpid()}")
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        _refuse_to_replace(path)
        mask = os.umask(0o177)
        try:
            listener.bind(str(temporary))
        finally:
            os.umask(mask)
        listener.listen(_BACKLOG)
        listener.setblocking(False)
        temporary.rename(path)
    except OSError as error:
        listener.close()
        temporary.unlink(missing_ok=True)
        raise HubError(f"no hub can be at {path}: {error.strerror or error}") from error
    except HubError:
        listener.close()
        raise
    return listener


def _refuse_to_replace(path: Path) -> None:
    """Accept at `path` nothing or the socket of a killed hub.

    Raises:
        HubError: A hub answers there, or the file there is no socket.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(mode):
        raise HubError(f"no hub can be at {path}: that is not a socket")
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
        probe.settimeout(1.0)
        if probe.connect_ex(str(path)) != errno.ECONNREFUSED:
            raise HubPresentError(f"a hub is at {path} already")
