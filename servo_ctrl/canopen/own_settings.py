"""Stored settings of our own node: 1010h stores them, 1011h restores the defaults at the next start.

They are those that a client can change: 1017h, 1800h and 1A00h. A file that cannot be read counts as absent.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from servo_ctrl.canopen.errors import AbortCode, SdoAbort
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.files.whole_file import write_text_whole

STORE, RESTORE = 0x1010, 0x1011
SIGNATURES = {STORE: 0x6576_6173, RESTORE: 0x6461_6F6C}
"""Signatures "save" and "load" (CiA 301)."""
ON_COMMAND = 1
"""Value of both objects: parameters are stored on command."""
FILE = "own_node.json"


class SettingsStoreError(ServoCtrlError):
    """The settings of our node could not be written."""


class OwnSettings:
    """`values` returns the present settings by name; `write` stores them, or removes them for None."""

    def __init__(
        self, values: Callable[[], Mapping[str, int]], write: Callable[[dict[str, int] | None], None]
    ) -> None:
        self._values, self._write = values, write

    def read(self, subindex: int) -> int:
        """Read an entry of 1010h or 1011h: there is one group, all parameters."""
        return ON_COMMAND if subindex else 1

    def store(self, _subindex: int, value: int) -> None:
        """Store the present settings. Raises SdoAbort."""
        _check(STORE, value)
        self._write(dict(self._values()))

    def restore(self, _subindex: int, value: int) -> None:
        """Remove the stored settings: the defaults apply at the next start (CiA 301). Raises SdoAbort."""
        _check(RESTORE, value)
        self._write(None)


def _check(index: int, value: int) -> None:
    if value != SIGNATURES[index]:
        raise SdoAbort(AbortCode.CANNOT_STORE)


def load_settings(file: Path) -> dict[str, int]:
    """Read the settings of a file; none if it is absent or damaged."""
    try:
        content: Any = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(content, dict):
        return {}
    return {name: value for name, value in content.items() if type(value) is int and 0 <= value < 1 << 32}


def write_settings(file: Path, values: dict[str, int] | None) -> None:
    """Write the settings atomically; None removes the file. Raises SettingsStoreError."""
    try:
        if values is None:
            file.unlink(missing_ok=True)
            return
        file.parent.mkdir(parents=True, exist_ok=True)
        write_text_whole(file, json.dumps(values))
    except OSError as error:
        raise SettingsStoreError(
            f"{file}: settings of the controller's node not written: {error.strerror}"
        ) from None
