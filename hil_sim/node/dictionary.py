"""The object dictionary of one node: the objects that its EDS file describes, and their values.

The canopen library reads the file and encodes the data types; no other file of the simulator imports it.
Process objects are plain attributes. Every write of a client is checked against the limits of the EDS, and by
the check of the service that owns the object.
"""

import copy
import io
import math
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from hil_sim.node.process_objects import Address, ProcessObjects, attribute_names
from hil_sim.node.sdo_abort import AbortCode, SdoAbort, wrong_length
from kernels.lean_import import as_if_absent

with as_if_absent("asammdf"):  # python-can loads it for MF4 logs, and pandas with it: 0.5 s of every start
    import canopen
    from canopen.objectdictionary import ObjectDictionaryError, ODVariable
    from canopen.objectdictionary.datatypes import DATA_TYPES, NUMBER_TYPES, SIGNED_TYPES

STORE_EDS = 0x1021
FIRST_OBJECT = 0x1000
"""Below it are data types, which a PDO may map as dummies and no client can access."""


class Dictionary:
    """Values of all objects of node `node_id`; a value is an int, str or bytes.

    `checks[index](subindex, value)` may refuse a write by raising SdoAbort; `readers[index](subindex)`
    returns a computed value, or None; `followers[index](subindex)` is called after a write.

    Raises:
        OSError, ValueError: the EDS cannot be read, or is damaged.
    """

    def __init__(
        self, node_id: int, eds: Path, objects: ProcessObjects, inside_eds: Path | None = None
    ) -> None:
        """Describe the objects by `eds`, and by `inside_eds` those that clients cannot access."""
        self.node_id = node_id
        self.objects = objects
        self.attributes = attribute_names(objects)
        self.checks: dict[int, Callable[[int, Any], None]] = {}
        self.readers: dict[int, Callable[[int], Any]] = {}
        self.followers: dict[int, Callable[[int], None]] = {}
        self.on_write: Callable[[int, int], None] = lambda _index, _subindex: None
        """Called after every write of a client, to any object."""
        self.stored: dict[Address, bytes] = {}
        """Encoded values of the objects that are not attributes and differ from the default."""
        self._eds, self._eds_text = eds, eds.read_bytes()
        self.variables: dict[Address, Any] = described(self._eds_text, str(eds), node_id)
        """Description of every object of the EDS, as canopen reads it, by address."""
        self.hidden: set[Address] = set()
        """Objects that no client can access."""
        if inside_eds is not None:
            inside = described(inside_eds.read_bytes(), str(inside_eds), node_id)
            self.hidden = inside.keys() - self.variables.keys()
            self.variables = dict(sorted({**inside, **self.variables}.items()))
        self.indices = sorted({index for index, _subindex in self.variables.keys() - self.hidden})
        for index, subindex in sorted(self.attributes.keys() - self.variables.keys()):
            raise ValueError(f"object {index:04X}h:{subindex:02X} is missing")
        self.load_defaults(0x1000, 0xFFFF)

    def readdress(self, node_id: int) -> None:
        """Describe the objects for another node id; the caller loads their values again."""
        self.node_id = node_id
        self.variables = described(self._eds_text, str(self._eds), node_id)

    def variable(self, index: int, subindex: int) -> Any:
        """Return the description of an object. Raises SdoAbort where the EDS has none."""
        found = self.variables.get((index, subindex))
        if found is None:
            known = index in self.indices
            raise SdoAbort(AbortCode.NO_SUCH_SUBINDEX if known else AbortCode.NO_SUCH_OBJECT)
        return found

    def check_writable(self, index: int, subindex: int) -> None:
        """Raise SdoAbort where a client cannot write this object at all."""
        if index < FIRST_OBJECT or (index, subindex) in self.hidden:
            raise SdoAbort(AbortCode.NO_SUCH_OBJECT)
        if not self.variable(index, subindex).writable:
            raise SdoAbort(AbortCode.WRITE_OF_READ_ONLY)

    def check_readable(self, index: int, subindex: int) -> None:
        """Raise SdoAbort where a client cannot read this object."""
        if index < FIRST_OBJECT or (index, subindex) in self.hidden:
            raise SdoAbort(AbortCode.NO_SUCH_OBJECT)
        if not self.variable(index, subindex).readable:
            raise SdoAbort(AbortCode.READ_OF_WRITE_ONLY)

    def decode(self, index: int, subindex: int, data: bytes) -> Any:
        """Decode `data`. Raises SdoAbort where the EDS has no such object, ValueError for a wrong length."""
        try:
            return self.variable(index, subindex).decode_raw(data)
        except ObjectDictionaryError as error:
            raise ValueError(str(error)) from error

    def value(self, index: int, subindex: int = 0) -> Any:
        """Return the present value, decoded by its data type."""
        return self.decode(index, subindex, self.get_data(index, subindex))

    def get_data(self, index: int, subindex: int) -> bytes:
        """Return the encoded value: of a reader, the attribute, the stored one, or the default of the EDS."""
        variable = self.variable(index, subindex)
        value = self.readers[index](subindex) if index in self.readers else None
        name = self.attributes.get((index, subindex))
        if value is None and name is not None:
            value = wrapped(getattr(self.objects, name), variable)
        if value is None:
            value = self.stored.get((index, subindex), variable.value)
        if value is None:
            value = variable.default
        if value is None:
            if variable.data_type in DATA_TYPES:
                return b""  # a string or domain without a value
            raise SdoAbort(AbortCode.RESOURCE_NOT_AVAILABLE)
        return bytes(variable.encode_raw(value))

    def put(self, index: int, subindex: int, value: Any) -> None:
        """Set a value from inside the device, without checks and followers."""
        name = self.attributes.get((index, subindex))
        if name is not None:
            setattr(self.objects, name, value)
        else:
            self.stored[index, subindex] = self.variable(index, subindex).encode_raw(value)

    def set_data(self, index: int, subindex: int, data: bytes) -> None:
        """Write an encoded value as a client does, then call its follower. Raises SdoAbort."""
        variable = self.variable(index, subindex)
        if variable.data_type in NUMBER_TYPES and 8 * len(data) != len(variable):
            raise wrong_length(8 * len(data), len(variable))
        value = self.decode(index, subindex, data)
        low, high = limits_of(variable)
        if isinstance(value, int) and not low <= value <= high:
            raise SdoAbort(AbortCode.VALUE_TOO_LOW if value < low else AbortCode.VALUE_TOO_HIGH)
        if index in self.checks:
            self.checks[index](subindex, value)
        name = self.attributes.get((index, subindex))
        if name is not None:
            setattr(self.objects, name, value)
        else:
            self.stored[index, subindex] = data
        if index in self.followers:
            self.followers[index](subindex)
        self.on_write(index, subindex)

    def load_defaults(self, first: int, last: int) -> None:
        """Set the objects `first` ... `last` to their defaults in the EDS."""
        self.stored = {key: data for key, data in self.stored.items() if not first <= key[0] <= last}
        for address, name in self.attributes.items():
            if first <= address[0] <= last and address not in self.objects.COMPUTED:
                setattr(self.objects, name, self.variables[address].default or 0)
        if first <= STORE_EDS <= last and STORE_EDS in self.indices:
            self.stored[STORE_EDS, 0] = self._eds_text


@lru_cache(maxsize=64)
def described(eds: bytes, file_name: str, node_id: int) -> dict[Address, Any]:
    """Return the objects of an EDS by address, shared and not to be changed.

    Raises whatever canopen raises at a damaged file.
    """
    return {address: _of_node(variable, node_id) for address, variable in _read(eds, file_name).items()}


@lru_cache(maxsize=16)
def _read(eds: bytes, file_name: str) -> dict[Address, Any]:
    """Read the objects for node id 0: nodes of a kind share an EDS, and reading one takes 50 ms."""
    source = io.StringIO(eds.decode())
    source.name = file_name  # canopen recognises the format by its ending
    found: dict[Address, Any] = {}
    for index, entry in sorted(canopen.import_od(source, 0).indices.items()):
        members = {0: entry} if isinstance(entry, ODVariable) else entry.subindices
        found.update(((index, subindex), member) for subindex, member in members.items())
    return found


def _of_node(variable: Any, node_id: int) -> Any:
    """Return the object of a node; where the EDS has $NODEID, its id is added."""
    if not variable.relative or not isinstance(variable.default, int):
        return variable
    own = copy.copy(variable)
    own.default = variable.default + node_id
    return own


def limits_of(variable: Any) -> tuple[float, float]:
    """Return the smallest and largest value of an object by its EDS; infinite where it sets no limit."""
    low, high = variable.min, variable.max
    return -math.inf if low is None else low, math.inf if high is None else high


def wrapped(value: int, variable: Any) -> int:
    """Wrap a value to the range of the object's type, as a counter does, and as a PDO does."""
    span = 1 << len(variable)
    value %= span
    return value - span if variable.data_type in SIGNED_TYPES and value >= span >> 1 else value
