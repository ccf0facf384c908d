"""Clauses about PDOs (CiA 301, 7.2.2 and 7.5.2): mapping, CAN-IDs, the answer to a SYNC."""

from servo_ctrl.conformance.clauses import (
    CANNOT_BE_MAPPED,
    ENTER_PRE_OPERATIONAL,
    OFF,
    OUT_OF_RANGE,
    START,
    TPDO,
    TPDO_MAPPING,
    NodeUnderTest,
    clause,
)
from servo_ctrl.conformance.dialogue import Dialogue, Failed, NotApplicable


@clause("CiA 301 7.5.2")
def mapping_while_on(node: NodeUnderTest) -> None:
    """A mapping is refused while its PDO is on."""
    if "w" not in node.variable(TPDO_MAPPING).access:
        raise NotApplicable("the mapping is fixed")
    if node.dialogue.number(TPDO, 1) & OFF:
        raise NotApplicable("TPDO 1 is off")
    node.dialogue.refused_write(TPDO_MAPPING, 0, b"\0")


@clause("CiA 301 7.5.2")
def not_mappable(node: NodeUnderTest) -> None:
    """An object that is not mappable by the EDS cannot be mapped: 06040041h."""
    with _Unmapped(node) as dialogue:
        dialogue.refused_write(TPDO_MAPPING, 1, (0x1018_0120).to_bytes(4, "little"), CANNOT_BE_MAPPED)


@clause("CiA 301 7.5.2")
def reserved_type(node: NodeUnderTest) -> None:
    """Reserved transmission type 241 is refused."""
    if "w" not in node.variable(TPDO, 2).access:
        raise NotApplicable("the transmission type is fixed")
    node.dialogue.refused_write(TPDO, 2, b"\xf1", *OUT_OF_RANGE)


@clause("CiA 301 7.3.5")
def restricted_identifier(node: NodeUnderTest) -> None:
    """A PDO refuses a restricted CAN-ID."""
    if "w" not in node.variable(TPDO, 1).access:
        raise NotApplicable("the identifier is fixed")
    dialogue = node.dialogue
    before = dialogue.read(TPDO, 1)
    off = int.from_bytes(before, "little") | OFF  # while the PDO is off, a node may accept any CAN-ID
    dialogue.write(TPDO, 1, off.to_bytes(4, "little"))
    try:
        dialogue.refused_write(TPDO, 1, (0x601).to_bytes(4, "little"), *OUT_OF_RANGE)
    finally:
        dialogue.write(TPDO, 1, off.to_bytes(4, "little"))
        dialogue.write(TPDO, 1, before)


@clause("CiA 301 7.2.2")
def synchronous_tpdo(node: NodeUnderTest) -> None:
    """A synchronous TPDO follows every SYNC in operational, and in no other state."""
    dialogue = node.dialogue
    node.without_errors()
    node.variable(TPDO, 1)
    cob_id, kind = dialogue.number(TPDO, 1), dialogue.number(TPDO, 2)
    if cob_id & OFF:
        raise NotApplicable("TPDO 1 is off")
    if "w" not in node.variable(TPDO, 2).access and kind != 1:
        raise NotApplicable(f"TPDO 1 has the transmission type {kind}")
    if kind != 1:
        dialogue.write(TPDO, 2, b"\1")
    entries = dialogue.number(TPDO_MAPPING, 0)
    bits = sum(dialogue.number(TPDO_MAPPING, entry) & 0xFF for entry in range(1, entries + 1))
    try:
        dialogue.drop_arrived()
        dialogue.send(0x080)
        dialogue.silence(cob_id & 0x7FF)
        dialogue.command(START)
        dialogue.number(0x1000)  # once it answers it has taken the command; another task may serve SYNC
        for _ in range(3):
            dialogue.send(0x080)
            frame = dialogue.wait_for(cob_id & 0x7FF)
            if frame is None or 8 * len(frame) != bits:
                raise Failed(f"{bits} bits are mapped, it sent {frame.hex(' ') if frame else 'nothing'}")
    finally:
        dialogue.command(ENTER_PRE_OPERATIONAL)
        if kind != 1:
            dialogue.write(TPDO, 2, bytes((kind,)))


class _Unmapped:
    """Context in which TPDO 1 is off and has no mapping; leaving it restores TPDO 1."""

    def __init__(self, node: NodeUnderTest) -> None:
        if "w" not in node.variable(TPDO_MAPPING).access:
            raise NotApplicable("the mapping is fixed")
        self._dialogue = node.dialogue

    def __enter__(self) -> Dialogue:
        dialogue = self._dialogue
        self._cob_id, self._entries = dialogue.read(TPDO, 1), dialogue.read(TPDO_MAPPING, 0)
        off = int.from_bytes(self._cob_id, "little") | OFF
        dialogue.write(TPDO, 1, off.to_bytes(4, "little"))
        dialogue.write(TPDO_MAPPING, 0, b"\0")
        self._first = dialogue.read(TPDO_MAPPING, 1)
        return dialogue

    def __exit__(self, *_: object) -> None:
        self._dialogue.write(TPDO_MAPPING, 1, self._first)
        self._dialogue.write(TPDO_MAPPING, 0, self._entries)
        self._dialogue.write(TPDO, 1, self._cob_id)
