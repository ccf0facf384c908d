"""PDOs of a slave: codecs compiled from the mapping by `struct`, and their transmission types.

No dictionary access in the cycle: a codec reads and writes the attributes of the process objects.
"""

import math
import struct
from collections.abc import Callable
from operator import attrgetter
from typing import Any, NamedTuple

from hil_sim.node.nmt import NEVER_US
from hil_sim.node.process_objects import ProcessObjects

LAST_SYNCHRONOUS, SAMPLED_AT_SYNC = 240, 252
"""Transmission types served at a SYNC: those up to the first, and the second, sent on request only."""
FORMATS = {2: "b", 3: "h", 4: "i", 5: "B", 6: "H", 7: "I"}  # CANopen data type -> struct


class MappedObject(NamedTuple):
    """One entry of a mapping: attribute (None for a dummy), CANopen type, limits."""

    attribute: str | None
    data_type: int
    low: float = -math.inf
    high: float = math.inf


class PdoSettings(NamedTuple):
    """Communication parameter of an enabled PDO. Times in microseconds, 0 is off."""

    cob_id: int
    transmission_type: int
    inhibit_us: int
    event_timer_us: int
    sync_start: int = 0
    """Counter of the SYNC that a TPDO begins with, 180xh:06; 0 is off."""
    remote: bool = True
    """Whether a remote frame is answered, bit 30 of the COB-ID."""


def compile_struct(mapping: list[MappedObject]) -> struct.Struct:
    """Little-endian layout of a mapping; dummy entries become padding."""
    codes = [(FORMATS[item.data_type], item.attribute) for item in mapping]
    return struct.Struct("<" + "".join(code if name else f"{struct.calcsize(code)}x" for code, name in codes))


class Rpdo:
    """Receive PDO: buffered until the SYNC (types 0-240), or acting at once (254, 255).

    `on_length(size, expected)` is called at a wrong length, and when the length is right again.
    Longer frames are cut, shorter ones dropped; a value outside the limits of its object is ignored.
    """

    def __init__(
        self,
        settings: PdoSettings,
        mapping: list[MappedObject],
        objects: ProcessObjects,
        on_length: Callable[[int, int], None],
    ) -> None:
        self.cob_id = settings.cob_id
        self.synchronous = settings.transmission_type <= LAST_SYNCHRONOUS
        self._layout = compile_struct(mapping)
        self._places = [(item.attribute, item.low, item.high) for item in mapping if item.attribute]
        self._objects = objects
        self._on_length = on_length
        self.wrong_length = False
        """Whether the last frame was of another length than the mapping."""
        self.mapping = tuple(mapping)
        self.pending: bytes | None = None
        """A frame that takes effect at the next SYNC."""
        self.event_timer_us = settings.event_timer_us
        self.deadline_us = NEVER_US

    @property
    def size(self) -> int:
        """Bytes of its data."""
        return self._layout.size

    def receive(self, data: bytes) -> bool:
        """Receive a frame; return whether process objects changed (asynchronous types)."""
        size = self._layout.size
        if len(data) != size or self.wrong_length:
            self.wrong_length = len(data) != size
            self._on_length(len(data), size)
            if len(data) < size:
                return False
            data = data[:size]
        self.pending = data
        return not self.synchronous and self.activate()

    def activate(self) -> bool:
        """Write the buffered frame to the process objects; return whether there was one."""
        data = self.pending
        if data is None:
            return False
        self.pending = None
        objects = self._objects
        for (name, low, high), value in zip(self._places, self._layout.unpack(data), strict=True):
            if low <= value <= high:
                setattr(objects, name, value)
        return True


class Tpdo:
    """A transmitted PDO: cyclic or acyclic synchronous (1-240, 0), or event-driven (254, 255)."""

    def __init__(
        self,
        settings: PdoSettings,
        mapping: list[MappedObject],
        objects: ProcessObjects,
        send: Callable[[int, bytes], None],
    ) -> None:
        self.cob_id = settings.cob_id
        self.settings, self.mapping = settings, tuple(mapping)
        kind = settings.transmission_type
        self.synchronous = kind <= LAST_SYNCHRONOUS or kind == SAMPLED_AT_SYNC
        self.every = kind
        self.syncs = 0
        self._layout = compile_struct(mapping)
        self._pack = self._layout.pack
        self._values = value_reader([item.attribute for item in mapping if item.attribute])
        self._objects = objects
        self._send = send
        self._sent: bytes | None = None
        self._free_at_us = 0
        self._timer_at_us = NEVER_US

    @property
    def cyclic(self) -> bool:
        """Whether every n-th SYNC sends it, counted from when it was enabled."""
        return type(self) is Tpdo and 0 < self.every <= LAST_SYNCHRONOUS

    @property
    def size(self) -> int:
        """Bytes of its data."""
        return self._layout.size

    def sample(self) -> bytes:
        """Return the frame of the present values; a value that does not fit wraps, as a counter does."""
        values = self._values(self._objects)
        try:
            return self._pack(*values)
        except struct.error:
            sizes = [struct.calcsize(code) for code in self._layout.format.strip("<")]
            return b"".join(
                (value % (1 << 8 * size)).to_bytes(size, "little")
                for value, size in zip(values, sizes, strict=True)
            )

    def on_sync(self) -> None:
        """Send at every n-th SYNC; type 0 only when a value has changed."""
        if self.every:
            self.syncs += 1
            if self.syncs < self.every:
                return
            self.syncs = 0
            self._send(self.cob_id, self.sample())
            return
        frame = self.sample()
        if frame != self._sent:
            self._sent = frame
            self._send(self.cob_id, frame)

    def on_request(self) -> None:
        """Send the present values at a remote frame."""
        self._send(self.cob_id, self.sample())

    def on_event_check(self, now_us: int) -> None:
        """Event-driven: send on a change or when the event timer is over, not within the inhibit time."""
        if now_us < self._free_at_us:
            return
        frame = self.sample()
        if frame == self._sent and now_us < self._timer_at_us:
            return
        self._sent = frame
        self._free_at_us = now_us + self.settings.inhibit_us
        if self.settings.event_timer_us:
            self._timer_at_us = now_us + self.settings.event_timer_us
        self._send(self.cob_id, frame)


def value_reader(attributes: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """Return a function that reads the attributes as a tuple, in C for two and more."""
    read = attrgetter(*attributes)
    return read if len(attributes) > 1 else lambda objects: (read(objects),)
