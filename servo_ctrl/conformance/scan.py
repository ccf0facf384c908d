"""Scans a bus: requests the device type of every node id, and the identity of those that respond."""

import time
from typing import NamedTuple

from servo_ctrl.conformance.dialogue import INITIATE, UPLOAD, Dialogue, Failed, Refused, Wire

NODE_IDS = range(1, 128)
SCAN_S = 1.0
"""Time for responses after the last request; chosen: slow nodes take some 100 ms."""
PROFILES = {401: "I/O", 402: "drive", 404: "measuring device", 406: "encoder", 418: "battery"}
"""Names of the CiA device profiles on a bus with drives."""


class FoundNode(NamedTuple):
    """A node that answered; objects that it lacks are None or empty."""

    node_id: int
    profile: int
    """Number of the CiA device profile; 0: none."""
    vendor: int | None
    product: int | None
    revision: int | None
    serial: int | None
    name: str
    """Manufacturer device name, 1008h."""

    @property
    def line(self) -> str:
        """Line for the terminal."""
        numbers = (self.vendor, self.product, self.revision, self.serial)
        identity = " ".join("-" if number is None else f"{number:08X}h" for number in numbers)
        kind = (
            f"CiA {self.profile} {PROFILES.get(self.profile, '')}".strip() if self.profile else "no profile"
        )
        return f"node {self.node_id:3d}  {kind:16s}  {identity}  {self.name}".rstrip()


def scan(wire: Wire) -> list[FoundNode]:
    """Return the nodes that answer SDO requests, by ascending node id. Nothing is written."""
    for node_id in NODE_IDS:
        wire.send(0x600 + node_id, INITIATE.pack(UPLOAD, 0x1000, 0, 0))
    types = {}
    ends_s = time.monotonic() + SCAN_S  # a bus with traffic is never silent
    while (left_s := ends_s - time.monotonic()) > 0.0 and (frame := wire.receive(left_s)) is not None:
        can_id, data = frame
        if can_id - 0x580 in NODE_IDS and data[:4] == b"\x43\x00\x10\x00":
            types[can_id - 0x580] = int.from_bytes(data[4:], "little")
    return [_described(Dialogue(wire, node_id), kind & 0xFFFF) for node_id, kind in sorted(types.items())]


def _described(dialogue: Dialogue, profile: int) -> FoundNode:
    vendor, product, revision, serial = (_number(dialogue, subindex) for subindex in (1, 2, 3, 4))
    try:
        name = dialogue.read(0x1008).rstrip(b"\0").decode("ascii", "replace")
    except (Refused, Failed):
        name = ""
    return FoundNode(
        node_id=dialogue.node_id,
        profile=profile,
        vendor=vendor,
        product=product,
        revision=revision,
        serial=serial,
        name=name,
    )


def _number(dialogue: Dialogue, subindex: int) -> int | None:
    try:
        return dialogue.number(0x1018, subindex)
    except (Refused, Failed):
        return None
