"""Store and restore parameters, 1010h and 1011h: "save" and "load" signatures, a JSON file per node.

Every object with access `rw` is stored; set points and commands have `rww` in the EDS and are not.
Stored values come back at the next reset (communication or node), defaults likewise.
"""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from canopen.objectdictionary import ObjectDictionaryError, ODVariable
from canopen.sdo.exceptions import SdoAbortedError

from hil_sim.node import abort_codes
from hil_sim.node.abort_codes import abort
from hil_sim.node.dictionary import Dictionary, limits_of

SAVE, LOAD = 0x6576_6173, 0x6461_6F6C  # "save" and "load" in ASCII
COMMUNICATION, APPLICATION = (0x1000, 0x1FFF), (0x2000, 0xFFFF)
FORMAT = 1
"""Version of the file; it is raised when the keys change their meaning."""
GROUPS = {1: (0x1000, 0xFFFF), 2: COMMUNICATION, 3: APPLICATION}
NOT_STORED = {0x1003, 0x1010, 0x1011}


class StoredParametersError(Exception):
    """A file of stored parameters that cannot be used: which one, and why."""

    def __init__(self, file: Path, reason: str) -> None:
        super().__init__(f"{file}: stored parameters: {reason}")
        self.file = file
        self.reason = reason


class Storage:
    """Parameters of one node across restarts; `file` None keeps them in memory only.

    `may_store()` refuses while the device is busy.

    Raises:
        StoredParametersError: the file cannot be read, or does not fit the object dictionary.
    """

    def __init__(self, dictionary: Dictionary, file: Path | None, may_store: Callable[[], bool]) -> None:
        self._dictionary = dictionary
        self._file = file
        self._may_store = may_store
        self._stored: dict[tuple[int, int], bytes] = {}
        dictionary.checks[0x1010] = self._save
        dictionary.checks[0x1011] = self._restore
        for index in (0x1010, 0x1011):
            dictionary.readers[index] = lambda subindex: 1 if subindex else None  # "on command"
        if file is not None and file.exists():
            self._stored = _read(file)
            for address, data in self._stored.items():
                self._check(file, address, data)

    def _check(self, file: Path, address: tuple[int, int], data: bytes) -> None:
        """Refuse a value that no client could have written: the file may be edited, or of another version."""
        name = f"{address[0]:04X}:{address[1]:02X}"
        try:
            variable = self._dictionary.variable(*address)
            value = variable.decode_raw(data)
        except (SdoAbortedError, ObjectDictionaryError, UnicodeDecodeError) as error:
            raise StoredParametersError(file, f"{name}: {error}") from error
        low, high = limits_of(variable)
        if variable.access_type != "rw" or (isinstance(value, int) and not low <= value <= high):
            raise StoredParametersError(file, f"{name} cannot be {value!r}")

    def load(self, first: int, last: int) -> None:
        """Put the stored values of objects `first` ... `last` into the dictionary."""
        for (index, subindex), data in self._stored.items():
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
        stored = dict(self._stored)
        for variable in self._parameters(*GROUPS[subindex]):
            key = (variable.index, variable.subindex)
            has_value = variable.default is not None or variable.index in self._dictionary.data_store
            if has_value:
                stored[key] = bytes(self._dictionary.get_data(*key))
        self._replace_stored(stored)

    def _restore(self, subindex: int, value: int) -> None:
        if value != LOAD or subindex not in GROUPS:
            raise abort(abort_codes.CANNOT_STORE)
        if not self._may_store():
            raise abort(abort_codes.WRONG_DEVICE_STATE)
        first, last = GROUPS[subindex]
        self._replace_stored({key: data for key, data in self._stored.items() if not first <= key[0] <= last})

    def _replace_stored(self, stored: dict[tuple[int, int], bytes]) -> None:
        if self._file is not None:
            _write(self._file, stored)
        self._stored = stored


def _write(file: Path, stored: dict[tuple[int, int], bytes]) -> None:
    """Replace the file in one step, so a kill leaves the old one or the new one."""
    objects = {f"{index:04X}:{sub:02X}": data.hex() for (index, sub), data in sorted(stored.items())}
    content = {"format": FORMAT, **objects}
    temporary = file.with_suffix(".tmp")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with temporary.open("w", encoding="utf-8") as stream:
            json.dump(content, stream, indent=1)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(file)
    except OSError as error:
        raise abort(abort_codes.CANNOT_STORE) from error


def _read(file: Path) -> dict[tuple[int, int], bytes]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        found = content.pop("format", FORMAT)  # the first hil-sim wrote no format
    except OSError as error:
        raise StoredParametersError(file, error.strerror or "cannot be read") from error
    except (ValueError, AttributeError, TypeError, RecursionError) as error:
        raise StoredParametersError(file, str(error)) from error
    if type(found) is not int or found != FORMAT:
        raise StoredParametersError(file, f"has format {found!r}, this hil-sim reads {FORMAT}: update it")
    try:
        pairs = [(key.split(":"), bytes.fromhex(data)) for key, data in content.items()]
        return {(int(index, 16), int(sub, 16)): data for (index, sub), data in pairs}
    except (ValueError, TypeError) as error:
        raise StoredParametersError(file, str(error)) from error
