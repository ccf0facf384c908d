"""Store and restore parameters, 1010h and 1011h: "save" and "load" signatures, a JSON file per node.

What is stored is every object with access `rw`; set points and commands are `rww` in the EDS and are not.
Stored values come back at the next reset (communication or node), defaults likewise.
"""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

from canopen.objectdictionary import ODVariable

from hil_sim.node import abort_codes
from hil_sim.node.abort_codes import abort

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from hil_sim.node.dictionary import Dictionary

SAVE, LOAD = 0x6576_6173, 0x6461_6F6C  # "save" and "load" in ASCII
COMMUNICATION, APPLICATION = (0x1000, 0x1FFF), (0x2000, 0xFFFF)
GROUPS = {1: (0x1000, 0xFFFF), 2: COMMUNICATION, 3: APPLICATION}
NOT_STORED = {0x1003, 0x1010, 0x1011}


class Storage:
    """Parameters of one node across restarts; `file` None keeps them in memory only.

    `may_store()` refuses while the device is busy. Raises ValueError naming the file if it is damaged.
    """

    def __init__(self, dictionary: Dictionary, file: Path | None, may_store: Callable[[], bool]) -> None:
        self._dictionary = dictionary
        self._file = file
        self._may_store = may_store
        self._kept: dict[tuple[int, int], bytes] = {}
        dictionary.checks[0x1010] = self._save
        dictionary.checks[0x1011] = self._restore
        for index in (0x1010, 0x1011):
            dictionary.readers[index] = lambda subindex: 1 if subindex else None  # "on command"
        if file is not None and file.exists():
            self._kept = _read(file)

    def load(self, first: int, last: int) -> None:
        """Put the stored values of objects `first` ... `last` into the dictionary."""
        for (index, subindex), data in self._kept.items():
            if first <= index <= last:
                variable = self._dictionary.variable(index, subindex)
                self._dictionary.put(index, subindex, variable.decode_raw(data))

    def _parameters(self, first: int, last: int) -> list[Any]:
        entries = self._dictionary.object_dictionary.indices
        found = []
        for index in sorted(entries):
            if first <= index <= last and index not in NOT_STORED:
                entry = entries[index]
                members = [entry] if isinstance(entry, ODVariable) else entry.subindices.values()
                found += [variable for variable in members if variable.access_type == "rw"]
        return found

    def _save(self, subindex: int, value: int) -> None:
        if value != SAVE or subindex not in GROUPS:
            raise abort(abort_codes.CANNOT_STORE)
        if not self._may_store():
            raise abort(abort_codes.WRONG_DEVICE_STATE)
        for variable in self._parameters(*GROUPS[subindex]):
            key = (variable.index, variable.subindex)
            has_value = variable.default is not None or variable.index in self._dictionary.data_store
            if has_value:
                self._kept[key] = bytes(self._dictionary.get_data(*key))
        self._write()

    def _restore(self, subindex: int, value: int) -> None:
        if value != LOAD or subindex not in GROUPS:
            raise abort(abort_codes.CANNOT_STORE)
        if not self._may_store():
            raise abort(abort_codes.WRONG_DEVICE_STATE)
        first, last = GROUPS[subindex]
        self._kept = {key: data for key, data in self._kept.items() if not first <= key[0] <= last}
        self._write()

    def _write(self) -> None:
        """Replace the file in one step, so a kill leaves the old one or the new one."""
        if self._file is None:
            return
        content = {f"{index:04X}:{sub:02X}": data.hex() for (index, sub), data in sorted(self._kept.items())}
        temporary = self._file.with_suffix(".tmp")
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            with temporary.open("w", encoding="utf-8") as stream:
                json.dump(content, stream, indent=1)
                stream.flush()
                os.fsync(stream.fileno())
            temporary.replace(self._file)
        except OSError as error:
            raise abort(abort_codes.CANNOT_STORE) from error


def _read(file: Path) -> dict[tuple[int, int], bytes]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        pairs = [(key.split(":"), bytes.fromhex(data)) for key, data in content.items()]
        return {(int(index, 16), int(sub, 16)): data for (index, sub), data in pairs}
    except (ValueError, AttributeError, TypeError) as error:
        raise ValueError(f"{file}: stored parameters are damaged: {error}") from error
