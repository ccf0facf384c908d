"""The canopen library behind one file: its EDS reader and its SDO client.

The library's network has neither a bus nor its Notifier thread here: our reader calls `Network.notify`, and
everything the network sends goes through `send`. Our own node is not the library's LocalNode, because its SDO
server accepts frames of any length, writes without checking limits, and raises struct.error on a segment
without a transfer.
"""

import configparser
import io
import logging
import math
import struct
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from kernels.lean_import import as_if_absent
from servo_ctrl.canopen.errors import EdsError, SdoError
from servo_ctrl.errors import first_line

with as_if_absent("asammdf"):  # python-can imports it and pandas for MF4 logs: 0.5 s at every start
    import canopen
    from canopen.objectdictionary import (
        ObjectDictionary,
        ObjectDictionaryError,
        ODArray,
        ODRecord,
        ODVariable,
    )
    from canopen.sdo.client import SdoClient
    from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

Response = TypeVar("Response")

SDO_TIMEOUT_S = 0.3
"""Longest wait for the response to one SDO request, wall clock, seconds; chosen."""
LOCKSTEP_SDO_TIMEOUT_S = 1.0
"""The same for a simulator in lockstep, which may have to wait for the processor; chosen."""
SDO_TRIES = 3
"""Requests sent before a node counts as silent; chosen."""
ADDRESSED_RESPONSES = {2, 3, 4}
"""Server command specifiers of responses that name an entry: initiate upload and download, abort."""
TRANSFER_LIMIT_S = 5.0
"""Bounds one transfer with all its segments, seconds; chosen: a node might never end it."""
NO_ADDRESS = bytes(3)
"""Address in an abort without a request; object 0000h is never requested."""

# We report an SDO failure once, with the node's name; the library's log would repeat it.
logging.getLogger("canopen").addHandler(logging.NullHandler())
logging.getLogger("canopen").propagate = False


class Network(canopen.Network):
    """A canopen network that sends its frames through `send(can_id, data)`."""

    def __init__(self, send: Callable[[int, bytes], None]) -> None:
        super().__init__()
        self.unsubscribe(self.lss.LSS_RX_COBID)  # its queue would keep all frames of an LSS master
        self._send = send

    def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
        """Send one data frame; the library passes bytes or lists of integers. Remote frames are not used."""
        if remote:
            raise NotImplementedError("remote frames are not used (CiA 301 advises against them)")
        with self.send_lock:
            self._send(can_id, bytes(data))


@dataclass(frozen=True, slots=True)
class EdsVariable:
    """One entry of an EDS. `data_type` is the CiA 301 code; None where the EDS has no default or limit."""

    name: str
    index: int
    subindex: int
    data_type: int
    access: str
    pdo_mappable: bool
    default: int | str | None
    low: int | None = None
    high: int | None = None
    label: str = ""
    """Parameter name of the entry, as the EDS writes it."""
    object_label: str = ""
    """Parameter name of its index."""
    default_text: str = ""
    """The default of any data type as text; "" without one."""

    @property
    def address(self) -> str:
        """Notation of the machine file, e.g. "0x6071:00"."""
        return f"0x{self.index:04X}:{self.subindex:02X}"


@dataclass(frozen=True, slots=True)
class Eds:
    """An electronic data sheet: the entries of a node by (index, subindex)."""

    path: Path
    variables: dict[tuple[int, int], EdsVariable]

    def __contains__(self, address: tuple[int, int]) -> bool:
        return address in self.variables

    def default(self, index: int, subindex: int = 0) -> int | None:
        """The integer default of an entry, None where there is no entry, no default or another type."""
        variable = self.variables.get((index, subindex))
        return variable.default if variable is not None and isinstance(variable.default, int) else None


def load_eds(path: Path, node_id: int) -> Eds:
    """Read an EDS for a node id ($NODEID is filled in). Raises EdsError naming the file."""
    try:
        variables = _parsed_eds(path.read_text(encoding="utf-8"), path.name)
    except FileNotFoundError:
        raise EdsError(f"{path}: no such EDS file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise EdsError(f"{path}: EDS cannot be read: {error}") from None
    except (configparser.Error, ObjectDictionaryError, ValueError, KeyError, AttributeError) as error:
        raise EdsError(f"{path}: not a readable EDS: {first_line(error)}") from None
    if (0x1000, 0) not in variables:
        raise EdsError(f"{path}: not a CANopen EDS: object 1000h (device type) is missing")
    return Eds(
        path,
        {
            address: _with_node_id(variable, node_id if relative else 0)
            for address, (variable, relative) in variables.items()
        },
    )


@lru_cache(maxsize=16)
def _parsed_eds(text: str, file_name: str) -> dict[tuple[int, int], tuple[EdsVariable, bool]]:
    """Return the entries of an EDS for node id 0, and whether each adds $NODEID to its default.

    Nodes of a kind share an EDS, and reading one takes 50 ms.
    """
    source = io.StringIO(text)
    source.name = file_name  # the library takes the format from it
    entries = _flatten(canopen.import_od(source, 0))
    return {(v.index, v.subindex): (_variable(v), v.relative) for v in entries}


def _with_node_id(variable: EdsVariable, node_id: int) -> EdsVariable:
    if not isinstance(variable.default, int) or not node_id:
        return variable
    default = variable.default + node_id
    return replace(variable, default=default, default_text=str(default))


def _flatten(dictionary: ObjectDictionary) -> Iterator[ODVariable]:
    for entry in dictionary.values():
        if isinstance(entry, ODVariable):
            yield entry
        else:
            yield from entry.values()


def _variable(source: ODVariable) -> EdsVariable:
    default: Any = source.default
    return EdsVariable(
        name=source.qualname.lower().replace(" ", "_"),
        index=source.index,
        subindex=source.subindex,
        data_type=source.data_type or 0,
        access=source.access_type,
        pdo_mappable=source.pdo_mappable,
        default=default if isinstance(default, int | str) else None,
        low=source.min,
        high=source.max,
        label=source.name,
        object_label=source.parent.name if isinstance(source.parent, ODArray | ODRecord) else source.name,
        default_text="" if default is None else str(default),
    )


class _TimeLimitedClient(SdoClient):
    """The library's client, with a bound on each transfer."""

    deadline_s = math.inf
    """Time on the monotonic clock at which the present transfer fails."""

    def read_response(self) -> bytes:
        if time.monotonic() > self.deadline_s:
            raise SdoCommunicationError(f"not over within {TRANSFER_LIMIT_S:g} s")
        response: bytes = super().read_response()  # type: ignore[no-untyped-call]  # the library is half typed
        return response


class SdoPort:
    """Blocking SDO access to one node, for a worker thread; every wait is bounded.

    The library gets no dictionary, because we read and write plain little-endian integers, whose sizes the
    boot plan knows.
    """

    def __init__(
        self, network: Network, node_id: int, *, timeout_s: float = SDO_TIMEOUT_S, tries: int = SDO_TRIES
    ) -> None:
        self.node_id = node_id
        self._network = network
        no_dictionary = ObjectDictionary()  # type: ignore[no-untyped-call]  # the library is only half typed
        self._client = _TimeLimitedClient(  # type: ignore[no-untyped-call]  # the same
            0x600 + node_id, 0x580 + node_id, no_dictionary
        )
        self._client.network = network
        self._client.RESPONSE_TIMEOUT = timeout_s
        self._tries = tries
        self._address = b""
        """Index and subindex of the request, as in its frame."""
        network.subscribe(0x580 + node_id, self._on_response)

    def close(self) -> None:
        """Stop receiving the node's responses."""
        self._network.unsubscribe(0x580 + self.node_id, self._on_response)

    def read(self, index: int, subindex: int) -> bytes:
        """Upload an entry. Raises SdoError if the node refuses it or responds to no try."""
        return self._with_tries(lambda: self._client.upload(index, subindex), index, subindex, "reading")

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Download an entry. Raises SdoError if the node refuses it or responds to no try."""
        self._with_tries(lambda: self._client.download(index, subindex, data), index, subindex, "writing")

    def _on_response(self, can_id: int, data: bytearray, timestamp_s: float) -> None:
        """Pass on a response to our request; drop responses to another client of the node."""
        if len(data) != 8:
            return
        if data[0] >> 5 in ADDRESSED_RESPONSES and bytes(data[1:4]) not in {self._address, NO_ADDRESS}:
            return
        self._client.on_response(can_id, data, timestamp_s)  # type: ignore[no-untyped-call]  # half typed

    def _with_tries(self, request: Callable[[], Response], index: int, subindex: int, verb: str) -> Response:
        transfer = f"{verb} {index:04X}h:{subindex:02X}"
        self._address = struct.pack("<HB", index, subindex)
        for _ in range(self._tries):
            self._client.deadline_s = time.monotonic() + TRANSFER_LIMIT_S
            try:
                return request()
            except SdoAbortedError as abort:
                raise SdoError(f"{transfer} was refused: {abort}", abort.code) from None
            except SdoCommunicationError:
                continue
        raise SdoError(f"{transfer} was not answered ({self._tries} tries)")
