"""Makes the directory of the local socket: private to this user, new for each run unless one is chosen.

A killed controller leaves its directory, but the kernel releases its lock. So the next controller removes
directories of this user that are not locked and whose socket does not answer.
"""

import contextlib
import fcntl
import os
import socket
import stat
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from servo_ctrl.errors import ServoCtrlError

PREFIX, NAME = "servo-ctrl-page-", "page.sock"
YOUNG_S = 60.0
"""A controller may not have locked a younger directory yet, seconds; chosen."""
CONNECT_LIMIT_S = 1.0
"""Bounds the attempt to connect to an existing socket, seconds; chosen."""


class LocalSocketError(ServoCtrlError):
    """The socket cannot be made."""


@contextlib.contextmanager
def new_private_directory() -> Iterator[Path]:
    """Yield a socket path in a new directory, removed after the block. Raises LocalSocketError."""
    try:
        directory = Path(tempfile.mkdtemp(prefix=PREFIX))  # 0700
        descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise LocalSocketError(f"no directory for the page's socket: {error.strerror}") from None
    try:
        with contextlib.suppress(OSError):  # without locks a socket that answers must suffice
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield directory / NAME
    finally:
        _remove(directory)
        os.close(descriptor)


@contextlib.contextmanager
def private_and_free(path: Path) -> Iterator[Path]:
    """Yield the chosen socket path, removed after the block. Raises LocalSocketError.

    Its directory must be private to this user, and no process may listen there.
    """
    try:
        status = path.parent.stat()
    except OSError as error:
        raise LocalSocketError(f"{path.parent}: {error.strerror}; make it, mode 700") from None
    if not _is_ours_alone(status):
        raise LocalSocketError(f"{path.parent}: is not a directory of this user alone; chmod 700 it")
    if path.exists() and not path.is_socket():
        raise LocalSocketError(f"{path}: exists and is not a socket; name another")
    if _answers(path):
        raise LocalSocketError(f"{path}: another controller serves it")
    try:
        yield path
    finally:
        path.unlink(missing_ok=True)


def remove_left_directories() -> None:
    """Remove the directories of killed controllers, as far as they can be read and removed."""
    with contextlib.suppress(OSError):
        for directory in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
            with contextlib.suppress(OSError):
                if _is_left(directory):
                    _remove(directory)


def _is_left(directory: Path) -> bool:
    """Whether a directory is ours, holds at most a socket, and its controller has ended. Raises OSError."""
    status = directory.lstat()
    if not _is_ours_alone(status) or time.time() - status.st_mtime < YOUNG_S:
        return False
    if {entry.name for entry in directory.iterdir()} - {NAME}:
        return False
    descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)  # BlockingIOError: its controller runs
        return not _answers(directory / NAME)
    finally:
        os.close(descriptor)


def _is_ours_alone(status: os.stat_result) -> bool:
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid() and not status.st_mode & 0o077


def _answers(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as probe:
        probe.settimeout(CONNECT_LIMIT_S)
        try:
            probe.connect(str(path))
        except TimeoutError:
            return True  # a process serves it slowly
        except OSError:
            return False
    return True


def _remove(directory: Path) -> None:
    """Remove the socket and its directory, but no other file."""
    with contextlib.suppress(OSError):
        (directory / NAME).unlink(missing_ok=True)
        directory.rmdir()
