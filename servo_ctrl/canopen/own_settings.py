"""Settings of our own node that outlive a run: 1010h stores them, 1011h has the defaults back at the next.

They are those that a client can change: 1017h and 1800h. The file is written and read by what is given to
`OwnSettings`, which is not our business; a file that cannot be read is as none.
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
"""Of "save" and "load" (CiA 301)."""
ON_COMMAND = 1
"""What both objects read: it is done on command."""
FILE = "own_node.json"


class SettingsStoreError(ServoCtrlError):
    """The settings of our node could not be written."""


class OwnSettings:
    """`values` gives the present settings by name; `write` puts them somewhere, None removes them."""

    def __init__(
        self, values: Callable[[], Mapping[str, int]], write: Callable[[dict[str, int] | None], None]
    ) -> None:
        self._values, self._write = values, write

    def read(self, subindex: int) -> int:
        """An entry of 1010h or 1011h: there is one group, all parameters."""
        return ON_COMMAND if subindex else 1

    def store(self, _subindex: int, value: int) -> None:
        """Keep the present settings. Raises SdoAbort."""
        _check(STORE, value)
        self._write(dict(self._values()))

    def restore(self, _subindex: int, value: int) -> None:
        """Forget them: the defaults are back after the next start (CiA 301). Raises SdoAbort."""
        _check(RESTORE, value)
        self._write(None)


def _check(index: int, value: int) -> None:
    if value != SIGNATURES[index]:
        raise SdoAbort(AbortCode.CANNOT_STORE)


def load_settings(file: Path) -> dict[str, int]:
    """The settings in a file, none where there is none or it is damaged."""
    try:
        found: Any = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(found, dict):
        return {}
    return {name: value for name, value in found.items() if type(value) is int and 0 <= value < 1 << 32}


def write_settings(file: Path, values: dict[str, int] | None) -> None:
    """Write the settings, whole or not at all; None removes them. Raises SettingsStoreError."""
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
