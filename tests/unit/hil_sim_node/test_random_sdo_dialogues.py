"""500 random SDO dialogues of canopen's client, each answer equal to that of a reference model of CiA 301.

Uploads and downloads, expedited, in segments and in blocks, of right and wrong lengths, inside and outside
the limits, of objects that are there and that are not, and transfers that are broken off under way.
"""

import random
from itertools import groupby

import canopen
import pytest
from in_process_nodes import DRIVE, EDS, SCALE, InProcessNodes
from sdo_reference import ReferenceDictionary

DIALOGUES, SEED = 500, 23
PLAIN = {
    DRIVE: (
        *((index, 0) for index in (0x1015, 0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x6007)),
        *((index, 0) for index in (0x6065, 0x6066, 0x6067, 0x6068, 0x606D, 0x606F, 0x6071, 0x607A, 0x607C)),
        *((index, 0) for index in (0x6081, 0x6082, 0x6083, 0x6084, 0x6085, 0x6087, 0x6088, 0x609A, 0x60B1)),
        *(
            (0x6099, 1),
            (0x6099, 2),
            (0x60A4, 1),
            (0x60C2, 1),
            (0x60C2, 2),
            (0x60C5, 0),
            (0x60C6, 0),
            (0x60F8, 0),
        ),
        *(
            (0x1029, 1),
            (0x2000, 0),
            (0x2000, 0),
            (0x1008, 0),
            (0x1000, 0),
            (0x1018, 1),
            (0x6502, 0),
            (0x60AA, 0),
        ),
        *(
            (0x1018, 5),
            (0x6099, 3),
            (0x6081, 1),
            (0x2FFF, 0),
            (0x5FFF, 7),
            (0x0005, 0),
            (0x1F80, 0),
            (0x608F, 2),
        ),
    ),
    SCALE: (
        (0x1015, 0),
        (0x1029, 1),
        (0x1008, 0),
        (0x1000, 0),
        (0x6502, 0),
        (0x6004, 1),
        (0x1801, 3),
        (0x6505, 0),
    ),
}
"""Objects without side effects: a write changes no other object."""


class Dialogue:
    """One client at one node, and the model of the expected answers."""

    def __init__(
        self, nodes: InProcessNodes, node_id: int, reference: ReferenceDictionary, seed: int
    ) -> None:
        self._nodes = nodes
        self._node_id = node_id
        self._sdo = nodes.network[node_id].sdo
        self._reference = reference
        self._random = random.Random(seed)

    def run(self) -> None:
        """Run one to six steps."""
        for _ in range(self._random.randint(1, 6)):
            index, subindex = self._random.choice(PLAIN[self._node_id])
            step = self._random.choice(
                (self._upload, self._upload, self._download, self._download, self._break_off)
            )
            step(index, subindex)

    def _upload(self, index: int, subindex: int) -> None:
        expected = self._reference.upload(index, subindex)
        block = self._random.random() < 0.3
        try:
            if block:
                with self._sdo.open(index, subindex, "rb", block_transfer=True) as stream:
                    found: bytes | int = stream.read()
            else:
                found = self._sdo.upload(index, subindex)
        except canopen.SdoAbortedError as aborted:
            found = aborted.code
        assert found == expected, f"upload of {index:04X}h:{subindex:02X}, {block=}"

    def _download(self, index: int, subindex: int) -> None:
        data = self._data(index, subindex)
        expected = self._reference.download(index, subindex, data)
        way = self._random.choice(("expedited", "segments", "block"))
        code = 0
        try:
            if way == "block" and data:
                with self._sdo.open(index, subindex, "wb", size=len(data), block_transfer=True) as stream:
                    stream.write(data)
            else:
                self._sdo.download(index, subindex, data, force_segment=way == "segments")
        except canopen.SdoAbortedError as aborted:
            code = aborted.code
        assert code == expected, f"download of {data.hex()} to {index:04X}h:{subindex:02X}, {way}"

    def _data(self, index: int, subindex: int) -> bytes:
        """Return data, mostly of the right length; a number is often at or next to a limit."""
        entry = self._reference.entries.get((index, subindex))
        if entry is None or entry.size is None or self._random.random() < 0.15:
            return self._random.randbytes(self._random.choice((1, 2, 3, 4, 5, 7, 8, 14, 15, 889, 890, 1800)))
        edges = [edge + step for edge in (entry.low, entry.high) if edge is not None for step in (-1, 0, 1)]
        if edges and self._random.random() < 0.7:
            value = self._random.choice(edges) % (1 << 8 * entry.size)
            return value.to_bytes(entry.size, "little")
        return self._random.randbytes(entry.size)

    def _break_off(self, index: int, subindex: int) -> None:
        """Begin a download in segments and end it by an abort, a false toggle bit or another transfer."""
        address = index.to_bytes(2, "little") + bytes((subindex,))
        refused = self._refusal(index, subindex)
        begun = self._exchange(b"\x21" + address + (9).to_bytes(4, "little"))
        if refused:
            assert begun == b"\x80" + address + refused.to_bytes(4, "little")
            return
        assert begun == b"\x60" + address + bytes(4)
        end = self._random.choice(("abort", "toggle", "upload"))
        if end == "abort":
            assert self._exchange(b"\x80" + address + bytes(4)) is None
            assert self._exchange(b"\x01" + bytes(7)) == b"\x80\0\0\0\x01\0\x04\x05"
        elif end == "toggle":
            assert self._exchange(b"\x10" + bytes(7)) == b"\x80" + address + b"\0\0\x03\x05"
        else:
            self._upload(index, subindex)

    def _refusal(self, index: int, subindex: int) -> int:
        """Return the abort code of a download's first frame; its data follow."""
        values = dict(self._reference.values)
        code = self._reference.download(index, subindex, b"")
        self._reference.values = values
        return code if code in {0x06020000, 0x06090011, 0x06010002} else 0

    def _exchange(self, frame: bytes) -> bytes | None:
        self._nodes.frames.clear()
        self._nodes.put(0x600 + self._node_id, frame)
        answers = self._nodes.take(0x580 + self._node_id)
        assert len(answers) < 2
        return answers[0] if answers else None


@pytest.fixture(scope="module")
def nodes() -> InProcessNodes:
    nodes = InProcessNodes()
    for node_id in PLAIN:
        nodes.remote(node_id)
    return nodes


@pytest.mark.parametrize("part", range(5))
def test_every_answer_is_that_of_the_reference(nodes: InProcessNodes, part: int) -> None:
    files = {DRIVE: EDS / "servo_drive.eds", SCALE: EDS / "linear_scale.eds"}
    seeds = range(SEED + part, SEED + DIALOGUES, 5)
    for node_id, share in groupby(sorted(seeds, key=lambda seed: seed % 4 == 0), lambda seed: seed % 4 == 0):
        chosen = SCALE if node_id else DRIVE
        nodes.put(0, bytes((129, chosen)))  # the defaults again
        reference = ReferenceDictionary(files[chosen], chosen)
        for seed in share:
            Dialogue(nodes, chosen, reference, seed).run()
