"""Store and restore parameters, 1010h and 1011h: "save" and "load" signatures, a JSON file per node.

Every object with access `rw` is stored; set points and commands have `rww` in the EDS and are not stored.
Stored or restored values take effect at the next reset (communication or node).
"""

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path

from hil_sim.node.dictionary import Dictionary, limits_of
from hil_sim.node.process_objects import Address
from hil_sim.node.sdo_abort import AbortCode, SdoAbort

SAVE, LOAD = 0x6576_6173, 0x6461_6F6C  # "save" and "load" in ASCII
FORMAT = 1
"""Version of the file; it is raised when the keys change their meaning."""
GROUPS = {1: (0x1000, 0xFFFF), 2: (0x1000, 0x1FFF), 3: (0x2000, 0xFFFF)}
"""Objects by subindex: all, communication parameters, application parameters."""
NOT_STORED = {0x1003, 0x1010, 0x1011}


class StoredParametersError(Exception):
    """A file of stored parameters cannot be used; holds the file and the reason."""

    def __init__(self, file: Path, reason: str) -> None:
        super().__init__(f"{file}: stored parameters: {reason}")
        self.file = file
        self.reason = reason


class Storage:
    """Stored parameters of one node; `file` None keeps them in memory only.

    `may_store()` returns False while the device is busy.

    Raises:
        StoredParametersError: the file cannot be read, or does not fit the object dictionary.
    """

    def __init__(self, dictionary: Dictionary, file: Path | None, may_store: Callable[[], bool]) -> None:
        self._dictionary = dictionary
        self._file = file
        self._may_store = may_store
        self._stored: dict[Address, bytes] = {}
        dictionary.checks[0x1010] = self._save
        dictionary.checks[0x1011] = self._restore
        for index in (0x1010, 0x1011):
            dictionary.readers[index] = lambda subindex: 1 if subindex else None  # "on command"
        if file is not None and file.exists():
            self._stored = _read(file)
            for address, data in self._stored.items():
                self._check(file, address, data)

    def _check(self, file: Path, address: Address, data: bytes) -> None:
        """Refuse a value that no client could have written: an edited file, or one of another version."""
        name = f"{address[0]:04X}:{address[1]:02X}"
        try:
            value = self._dictionary.decode(*address, data)
        except (SdoAbort, ValueError) as error:
            raise StoredParametersError(file, f"{name}: {error}") from error
        variable = self._dictionary.variables[address]
        low, high = limits_of(variable)
        if variable.access_type != "rw" or (isinstance(value, int) and not low <= value <= high):
            raise StoredParametersError(file, f"{name} cannot be {value!r}")

    def load(self, first: int, last: int) -> None:
        """Put the stored values of objects `first` ... `last` into the dictionary."""
        for address, data in self._stored.items():
            if first <= address[0] <= last:
                self._dictionary.put(*address, self._dictionary.decode(*address, data))

    def _save(self, subindex: int, value: int) -> None:
        first, last = self._group(subindex, value == SAVE)
        dictionary = self._dictionary
        saved = {
            address: dictionary.get_data(*address)
            for address, variable in dictionary.variables.items()
            if first <= address[0] <= last
            and address[0] not in NOT_STORED
            and variable.access_type == "rw"
            and (variable.default is not None or address in dictionary.stored)
        }
        self._replace_stored(self._stored | saved)

    def _restore(self, subindex: int, value: int) -> None:
        first, last = self._group(subindex, value == LOAD)
        self._replace_stored({key: data for key, data in self._stored.items() if not first <= key[0] <= last})

    def _group(self, subindex: int, signed: bool) -> tuple[int, int]:
        """Return the range of objects that a command acts on.

        Raises SdoAbort without the signature of the command, or while the device is busy.
        """
        if not signed or subindex not in GROUPS:
            raise SdoAbort(AbortCode.CANNOT_STORE)
        if not self._may_store():
            raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)
        return GROUPS[subindex]

    def _replace_stored(self, stored: dict[Address, bytes]) -> None:
        if self._file is not None:
            _write(self._file, stored)
        self._stored = stored


def _write(file: Path, stored: dict[Address, bytes]) -> None:
    objects = {f"{index:04X}:{sub:02X}": data.hex() for (index, sub), data in sorted(stored.items())}
    try:
        replace_json(file, {"format": FORMAT, **objects})
    except OSError as error:
        raise SdoAbort(AbortCode.CANNOT_STORE) from error


def replace_json(file: Path, content: Mapping[str, object]) -> None:
    """Replace the file atomically: after a kill it is the old one or the new one. Raises OSError."""
    temporary = file.with_suffix(".tmp")
    file.parent.mkdir(parents=True, exist_ok=True)
    with temporary.open("w", encoding="utf-8") as stream:
        json.dump(content, stream, indent=1)
        stream.flush()
        os.fsync(stream.fileno())
    temporary.replace(file)


def _read(file: Path) -> dict[Address, bytes]:
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


VERIFY = 0x1020
NO_CONFIGURATION = frozenset({VERIFY, 0x1003, 0x1010})
"""Objects whose write changes no configuration; restoring defaults (1011h) does."""


def verify_configuration(dictionary: Dictionary) -> None:
    """Reset 1020h of a node, Verify configuration, whenever a client changes the configuration.

    CiA 301, 7.5.2.23: a configuration tool writes date and time, stores them with 1010h, and compares them
    after a reset.
    """

    def on_write(index: int, subindex: int) -> None:
        if index not in NO_CONFIGURATION and dictionary.variables[index, subindex].access_type == "rw":
            for member in (1, 2):
                dictionary.put(VERIFY, member, 0)

    dictionary.on_write = on_write
