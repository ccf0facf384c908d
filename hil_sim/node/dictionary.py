"""The object dictionary of one node, served from its EDS file.

canopen's LocalNode keeps the values. Added here: process objects are plain attributes, every write is checked
against the limits of the EDS and by the owner of the object, and sub-indices that the EDS does not list are
refused (canopen accepts any for arrays).
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import canopen
from canopen import objectdictionary
from canopen.objectdictionary.datatypes import SIGNED_TYPES
from canopen.sdo.exceptions import SdoAbortedError

from hil_sim.node import abort_codes
from hil_sim.node.abort_codes import abort
from hil_sim.node.process_objects import ProcessObjects, attribute_names
from hil_sim.node.sdo_server import BlockSdoServer

STORE_EDS = 0x1021


class Dictionary(canopen.LocalNode):
    """Values of all objects of node `node_id`.

    `checks[index](subindex, value)` may refuse a write by raising `abort(code)`; `readers[index](subindex)`
    returns a computed value, or None; `followers[index](subindex)` is called after a write. `value` is an
    int, str or bytes.

    Raises:
        OSError, ValueError: the EDS cannot be read, or is none.
    """

    def __init__(
        self, node_id: int, eds: Path, objects: ProcessObjects, send: Callable[[int, bytes], None]
    ) -> None:
        super().__init__(node_id, canopen.import_od(str(eds), node_id))
        self.node_id = node_id
        self._write_callbacks.clear()  # canopen's own NMT slave would start a heartbeat thread on 1017h
        self.sdo = self.server = BlockSdoServer(self, send)
        self.objects = objects
        self.attributes = attribute_names(objects)
        self.checks: dict[int, Callable[[int, Any], None]] = {}
        self.readers: dict[int, Callable[[int], Any]] = {}
        self.followers: dict[int, Callable[[int], None]] = {}
        self.add_read_callback(self._read)
        self.add_write_callback(self._write)
        self._eds_text = eds.read_bytes()
        self._check_objects()
        self.load_defaults(0x1000, 0xFFFF)

    def _check_objects(self) -> None:
        for index, subindex in self.attributes:
            try:
                self.variable(index, subindex)
            except SdoAbortedError as error:
                raise ValueError(f"object {index:04X}h:{subindex:02X} is missing") from error

    def variable(self, index: int, subindex: int) -> Any:
        """Description of an object. Raises SdoAbortedError where there is none."""
        entry = self.object_dictionary.indices.get(index)
        if entry is None:
            raise abort(abort_codes.NO_SUCH_OBJECT)
        if isinstance(entry, objectdictionary.ODVariable):
            if subindex:
                raise abort(abort_codes.NO_SUCH_SUBINDEX)
            return entry
        found = entry.subindices.get(subindex)
        if found is None:
            raise abort(abort_codes.NO_SUCH_SUBINDEX)
        return found

    _find_object = variable  # the name under which LocalNode looks objects up

    def value(self, index: int, subindex: int = 0) -> Any:
        """Present value, decoded by its data type."""
        return self.variable(index, subindex).decode_raw(self.get_data(index, subindex))

    def put(self, index: int, subindex: int, value: Any) -> None:
        """Set a value from inside the device: no check of access or range, no follower is called."""
        name = self.attributes.get((index, subindex))
        if name is not None:
            setattr(self.objects, name, value)
        else:
            encoded = self.variable(index, subindex).encode_raw(value)
            self.data_store.setdefault(index, {})[subindex] = encoded

    def load_defaults(self, first: int, last: int) -> None:
        """Give the objects `first` ... `last` the values they have in the EDS."""
        for index in [index for index in self.data_store if first <= index <= last]:
            del self.data_store[index]
        for (index, subindex), name in self.attributes.items():
            if first <= index <= last:
                default = self.variable(index, subindex).default
                setattr(self.objects, name, 0 if default is None else default)
        if first <= STORE_EDS <= last and STORE_EDS in self.object_dictionary:
            self.data_store[STORE_EDS] = {0: self._eds_text}

    def check_writable(self, index: int, subindex: int) -> None:
        """Raise SdoAbortedError where this object cannot be written at all."""
        if not self.variable(index, subindex).writable:
            raise abort(abort_codes.WRITE_OF_READ_ONLY)

    def _read(self, index: int, subindex: int, od: Any) -> Any:
        reader = self.readers.get(index)
        if reader is not None:
            computed = reader(subindex)
            if computed is not None:
                return computed
        name = self.attributes.get((index, subindex))
        return wrapped(getattr(self.objects, name), od) if name is not None else None

    def _write(self, index: int, subindex: int, od: Any, data: bytes) -> None:
        value = od.decode_raw(bytes(data))
        low, high = limits_of(od)
        if isinstance(value, int) and not low <= value <= high:
            raise abort(abort_codes.VALUE_OUT_OF_RANGE)
        check = self.checks.get(index)
        if check is not None:
            check(subindex, value)
        name = self.attributes.get((index, subindex))
        if name is not None:
            setattr(self.objects, name, value)

    def set_data(self, index: int, subindex: int, data: bytes, check_writable: bool = False) -> None:
        """Write a value from the bus, then call its follower."""
        super().set_data(index, subindex, data, check_writable)
        follower = self.followers.get(index)
        if follower is not None:
            follower(subindex)


def limits_of(variable: Any) -> tuple[float, float]:
    """Smallest and largest value of an object by its EDS; infinite where it sets none."""
    low, high = variable.min, variable.max
    return -math.inf if low is None else low, math.inf if high is None else high


def wrapped(value: int, variable: Any) -> int:
    """A value that does not fit the object's type wraps, as a counter does (and as it does in a PDO)."""
    span = 1 << len(variable)
    value %= span
    return value - span if variable.data_type in SIGNED_TYPES and value >= span >> 1 else value
