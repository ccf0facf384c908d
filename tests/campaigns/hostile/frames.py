"""Families of hostile frames: seeded, random or mutated from recorded traffic."""

from collections.abc import Callable, Iterator, Sequence
from random import Random
from typing import NamedTuple

import can

Generator = Callable[[Random, Sequence[tuple[int, bytes]]], Iterator["HostileFrame"]]

DRIVES, SCALES, OWN = (1, 2), (11, 12), 127
NODES = (*DRIVES, *SCALES)
NMT, SYNC = 0x000, 0x080
SET_POINTS, HEARTBEAT = 0x200, 0x700
OF_A_CONTROLLER = frozenset({NMT, SYNC, HEARTBEAT + OWN, *(SET_POINTS + drive for drive in DRIVES)})
"""Frames that only a controller of this machine may send."""
REQUESTS = frozenset(0x600 + node for node in NODES)
OBJECTS = (
    0x1000,
    0x1003,
    0x1005,
    0x1006,
    0x1010,
    0x1014,
    0x1016,
    0x1017,
    0x1021,
    0x1029,
    0x1400,
    0x1600,
    0x1800,
)
OBJECTS += (0x1A00, 0x2000, 0x2105, 0x2111, 0x2121, 0x6040, 0x6060, 0x6065, 0x607D, 0x6085, 0x6502)
BURST = 40
"""Most repetitions of a frame in a burst."""


class HostileFrame(NamedTuple):
    """A CAN frame with its flags."""

    can_id: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False
    error: bool = False

    def message(self) -> can.Message:
        """Convert to python-can's message; a remote frame has a length and no data."""
        return can.Message(
            arbitration_id=self.can_id,
            data=b"" if self.remote else self.data,
            dlc=len(self.data),
            is_extended_id=self.extended,
            is_remote_frame=self.remote,
            is_error_frame=self.error,
        )


def _bytes(rng: Random) -> bytes:
    return rng.randbytes(rng.choice((0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 8, 8)))


def noise(rng: Random, _traffic: Sequence[tuple[int, bytes]]) -> Iterator[HostileFrame]:
    """Yield frames of any identifier, length and flag."""
    while True:
        kind = rng.random()
        if kind < 0.8:
            yield HostileFrame(rng.randrange(0x800), _bytes(rng))
        elif kind < 0.9:
            yield HostileFrame(rng.getrandbits(29), _bytes(rng), extended=True)
        elif kind < 0.97:
            yield HostileFrame(rng.randrange(0x800), _bytes(rng), remote=True)
        else:
            yield error_frame(rng)


def error_frame(rng: Random) -> HostileFrame:
    """Return an error frame of any class but bus-off, which would rightly end the program."""
    return HostileFrame(rng.getrandbits(9) & ~0x40, rng.randbytes(8), error=True)


def mutated_traffic(rng: Random, traffic: Sequence[tuple[int, bytes]]) -> Iterator[HostileFrame]:
    """Yield recorded frames: replayed, repeated in a burst, or mutated."""
    while True:
        match rng.randrange(8):
            case 0:
                place = rng.randrange(len(traffic))
                yield from (HostileFrame(*one) for one in traffic[place : place + rng.randrange(1, BURST)])
            case 1:
                yield from rng.randrange(1, BURST) * (HostileFrame(*rng.choice(traffic)),)
            case _:
                yield _mutant(rng, *rng.choice(traffic), rng.choice(traffic)[1])


def _mutant(rng: Random, can_id: int, data: bytes, other: bytes) -> HostileFrame:
    """Return a frame with a flipped bit, other length, node, service, or the data of another at its end."""
    match rng.randrange(6):
        case 0 if data:
            bit = rng.randrange(8 * len(data))
            data = (int.from_bytes(data, "little") ^ 1 << bit).to_bytes(len(data), "little")
        case 1:
            data = data[: rng.randrange(9)]
        case 2:
            data = (data + rng.randbytes(8))[: rng.randrange(9)]
        case 3:
            can_id = can_id & 0x780 | rng.choice((*NODES, OWN, rng.randrange(128)))
        case 4:
            can_id = can_id & 0x7F | rng.randrange(16) << 7
        case _:
            data = data[:4] + other[4:]
    return HostileFrame(can_id, data)


def sdo_flood(rng: Random, _traffic: Sequence[tuple[int, bytes]]) -> Iterator[HostileFrame]:
    """Yield SDO requests and answers of every kind, to and from every node, mostly to existing objects."""
    while True:
        can_id = rng.choice((0x600, 0x600, 0x580)) + rng.choice((*NODES, OWN))
        head = rng.choice((0x40, 0x23, 0x2B, 0x2F, 0x21, 0x60, 0x70, 0x00, 0x01, 0x80, rng.randrange(256)))
        address = rng.choice(OBJECTS).to_bytes(2, "little") + bytes(
            (rng.choice((0, 0, 1, 2, 3, rng.randrange(256))),)
        )
        for _ in range(rng.choice((1, 1, 1, BURST))):
            yield HostileFrame(can_id, bytes((head,)) + address + rng.randbytes(4))


def half_transfers(rng: Random, _traffic: Sequence[tuple[int, bytes]]) -> Iterator[HostileFrame]:
    """Yield segmented and block transfers that end anywhere, some with wrong sequence numbers."""
    while True:
        can_id = 0x600 + rng.choice((*NODES, OWN))
        address = rng.choice(OBJECTS).to_bytes(2, "little") + b"\0"
        size = rng.choice((0, 5, 8, 100, 0xFFFF_FFFF)).to_bytes(4, "little")
        kind = rng.randrange(4)
        yield HostileFrame(
            can_id,
            bytes(((0x21, 0x40, 0xC6, 0xA4)[kind],)) + address + (b"\x7f\0\0\0" if kind == 3 else size),
        )
        for number in range(rng.randrange(130)):
            wrong = rng.random() < 0.05
            toggle = (number & 1) << 4
            sequence = rng.randrange(256) if wrong else number % 127 + 1
            heads = (toggle, 0x60 | toggle, sequence, rng.choice((0xA3, 0xA2, 0xA1)))
            tail = bytes((rng.randrange(128), rng.choice((0, 1, 127, 255)))) + rng.randbytes(5)
            yield HostileFrame(can_id, bytes((heads[kind] ^ (wrong and 0x10),)) + tail)


def nmt_storm(rng: Random, _traffic: Sequence[tuple[int, bytes]]) -> Iterator[HostileFrame]:
    """Yield NMT commands to one node, all nodes or none."""
    while True:
        command = rng.choice((1, 2, 0x80, 0x81, 0x82, rng.randrange(256)))
        yield HostileFrame(
            NMT,
            bytes((command, rng.choice((0, *NODES, OWN, rng.randrange(256)))))[: rng.choice((2, 2, 2, 1, 0))],
        )


def impostor_inputs(rng: Random, traffic: Sequence[tuple[int, bytes]]) -> Iterator[HostileFrame]:
    """Yield forged inputs of drives and scales: replayed, changed in a byte, or random."""
    inputs = [
        (can_id, data)
        for can_id, data in traffic
        if can_id & 0x7F in NODES and can_id & 0x780 in {0x180, 0x280}
    ]
    while True:
        can_id, data = rng.choice(inputs)
        if rng.random() < 0.5:
            place = rng.randrange(len(data))
            data = data[:place] + rng.randbytes(1) + data[place + 1 :]
        yield HostileFrame(
            can_id,
            rng.choice(
                (data, data, data, rng.randbytes(len(data)), data[:-1], data + b"\0")[: 6 - (len(data) > 7)]
            ),
        )


def impostor_set_points(rng: Random, traffic: Sequence[tuple[int, bytes]]) -> Iterator[HostileFrame]:
    """Yield forged set points and control words of the controller, with SYNC: a drive must obey them."""
    ours = [(can_id, data) for can_id, data in traffic if can_id in {SET_POINTS + drive for drive in DRIVES}]
    while True:
        can_id, data = rng.choice(ours)
        word = rng.choice((0x06, 0x07, 0x0F, 0x1F, 0x02, 0x80, rng.getrandbits(16))).to_bytes(2, "little")
        yield HostileFrame(can_id, rng.choice((data, word + data[2:], word + rng.randbytes(len(data) - 2))))
        if rng.random() < 0.3:
            yield HostileFrame(SYNC)


def sync_storm(rng: Random, _traffic: Sequence[tuple[int, bytes]]) -> Iterator[HostileFrame]:
    """Yield SYNC, with and without data."""
    while True:
        yield HostileFrame(SYNC, b"" if rng.random() < 0.9 else _bytes(rng))


def emcy_flood(rng: Random, _traffic: Sequence[tuple[int, bytes]]) -> Iterator[HostileFrame]:
    """Yield emergencies of every node, the controller's too."""
    while True:
        data = rng.choice((0x8611, 0x2310, 0x8130, 0, rng.getrandbits(16))).to_bytes(
            2, "little"
        ) + rng.randbytes(6)
        yield HostileFrame(
            0x080 + rng.choice((*NODES, OWN)), data[: rng.choice((8, 8, 8, 8, rng.randrange(9)))]
        )


def heartbeats(rng: Random, _traffic: Sequence[tuple[int, bytes]]) -> Iterator[HostileFrame]:
    """Yield heartbeats and boot-up messages of every node, the controller's too."""
    while True:
        state = rng.choice((0, 4, 5, 5, 127, rng.randrange(256)))
        yield HostileFrame(
            HEARTBEAT + rng.choice((*NODES, OWN)),
            rng.choice((bytes((state,)), bytes((state,)), b"", b"\5\5")),
        )


def own_heartbeat(rng: Random, _traffic: Sequence[tuple[int, bytes]]) -> Iterator[HostileFrame]:
    """Yield heartbeats of the controller's own node."""
    while True:
        yield HostileFrame(HEARTBEAT + OWN, bytes((rng.choice((0, 4, 5, 127)),)))


FAMILIES: dict[str, Generator] = {
    family.__name__: family
    for family in (
        noise,
        mutated_traffic,
        sdo_flood,
        half_transfers,
        nmt_storm,
        impostor_inputs,
        impostor_set_points,
        sync_storm,
        emcy_flood,
        heartbeats,
        own_heartbeat,
    )
}
OBEYED = frozenset(
    {"noise", "mutated_traffic", "sdo_flood", "half_transfers", "nmt_storm", "impostor_set_points"}
)
"""Families with frames that a drive must obey, whichever node sends them."""
NEVER_HARMLESS = frozenset({"nmt_storm", "impostor_set_points", "sync_storm", "own_heartbeat"})
"""Families in which no frame is harmless."""


def harmless(frame: HostileFrame) -> bool:
    """Return whether no node must obey this frame: no controller sends it, and it is not an SDO request."""
    if frame.extended or frame.remote or frame.error:
        return True
    return frame.can_id not in OF_A_CONTROLLER and frame.can_id not in REQUESTS
