"""Errors that servo_ctrl reports to its user: one line that names the file, the key and the reason."""

import os
from pathlib import Path


def first_line(error: BaseException) -> str:
    """The first line of a library's message; the kind of the error where there is no message."""
    return (str(error) or repr(error)).splitlines()[0]


def reason_of(error: OSError) -> str:
    """The system's reason alone; pyarrow's message is a paragraph."""
    return os.strerror(error.errno) if error.errno else str(error)


class ServoCtrlError(Exception):
    """Base of every error that servo_ctrl reports to its user as one line, without a traceback."""

    exit_status = 1
    """Of the command that it ends."""


class ConfigError(ServoCtrlError):
    """A machine or program file that cannot be used.

    `file` is the file as the user named it, `key` the dotted key inside it (empty for the whole
    file), `reason` what is wrong and, where there is one, the limit.
    """

    def __init__(self, file: Path | str, key: str, reason: str) -> None:
        self.file = str(file)
        self.key = key
        self.reason = reason
        super().__init__(": ".join(part for part in (self.file, key, reason) if part))
