"""Clauses about SDO (CiA 301, 7.2.4): abort codes, segments, blocks."""

from binascii import crc_hqx

from servo_ctrl.canopen.errors import AbortCode
from servo_ctrl.conformance.clauses import (
    NO_BLOCK_TRANSFER,
    OUT_OF_RANGE,
    WRONG_LENGTH,
    NodeUnderTest,
    clause,
    size_of,
)
from servo_ctrl.conformance.dialogue import INITIATE, Failed, NotApplicable, Refused, accepted


@clause("CiA 301 7.5.2")
def device_type(node: NodeUnderTest) -> None:
    """1000h device type is that of the EDS."""
    found, stated = node.dialogue.read(0x1000), node.eds.default(0x1000)
    if len(found) != 4 or (stated is not None and int.from_bytes(found, "little") != stated):
        raise Failed(f"1000h is {found.hex()}, the EDS says {stated}")


@clause("CiA 301 7.2.4")
def no_object(node: NodeUnderTest) -> None:
    """Object that does not exist: 06020000h."""
    absent = next(index for index in range(0x5FFF, 0x1FFF, -1) if (index, 0) not in node.eds)
    node.dialogue.refused_read(absent, 0, AbortCode.NO_SUCH_OBJECT)


@clause("CiA 301 7.2.4")
def no_subindex(node: NodeUnderTest) -> None:
    """Sub-index that does not exist: 06090011h."""
    node.dialogue.refused_read(0x1018, 0x7F, AbortCode.NO_SUCH_SUBINDEX)


@clause("CiA 301 7.2.4")
def read_only(node: NodeUnderTest) -> None:
    """Write of a read only object: 06010002h."""
    node.dialogue.refused_write(0x1000, 0, bytes(4), AbortCode.WRITE_OF_READ_ONLY)


@clause("CiA 301 7.2.4")
def write_only(node: NodeUnderTest) -> None:
    """Read of a write only object: 06010001h."""
    for (index, subindex), variable in sorted(node.eds.variables.items()):
        if variable.access == "wo":
            node.dialogue.refused_read(index, subindex, AbortCode.READ_OF_WRITE_ONLY)
            return
    raise NotApplicable("the EDS has none")


@clause("CiA 301 7.2.4")
def too_short(node: NodeUnderTest) -> None:
    """Write of too few bytes: 06070010h or 06070013h."""
    node.variable(0x1017)
    node.dialogue.refused_write(0x1017, 0, b"\1", *WRONG_LENGTH)


@clause("CiA 301 7.2.4")
def too_long(node: NodeUnderTest) -> None:
    """Write of too many bytes: 06070010h or 06070012h."""
    node.variable(0x1017)
    node.dialogue.refused_write(0x1017, 0, bytes(4), *WRONG_LENGTH)


@clause("CiA 301 7.2.4")
def beyond_limits(node: NodeUnderTest) -> None:
    """Value beyond the limits of the EDS: 06090030h to 06090032h, and not stored."""
    tried = 0
    for (index, subindex), variable in sorted(node.eds.variables.items()):
        size = size_of(variable)
        if variable.access not in {"rw", "rww", "rwr"} or variable.high is None or not size:
            continue
        signed = variable.data_type in {2, 3, 4, 0x15}
        largest = (1 << 8 * size - signed) - 1
        if variable.high >= largest or size > 4:
            continue
        before = node.dialogue.read(index, subindex)
        data = (variable.high + 1).to_bytes(size, "little", signed=signed)
        node.dialogue.refused_write(index, subindex, data, *OUT_OF_RANGE)
        if node.dialogue.read(index, subindex) != before:
            raise Failed(f"{index:04X}h:{subindex:02X} has changed although it was refused")
        tried += 1
    if not tried:
        raise NotApplicable("no writable object has a limit in the EDS")


@clause("CiA 301 7.2.4")
def segmented_upload(node: NodeUnderTest) -> None:
    """Segmented upload: toggle bit, announced size, end."""
    node.variable(0x1008)
    if len(node.dialogue.read(0x1008)) <= 4:
        raise NotApplicable("1008h fits one frame")


@clause("CiA 301 7.2.4")
def wrong_toggle(node: NodeUnderTest) -> None:
    """Toggle bit that does not alternate: 05030000h."""
    node.variable(0x1008)
    if node.dialogue.initiate(0x40, 0x1008, 0)[0] & 0x02:
        raise NotApplicable("1008h fits one frame")
    node.dialogue.refusal(b"\x70".ljust(8, b"\0"), AbortCode.TOGGLE_NOT_ALTERNATED)


@clause("CiA 301 7.2.4")
def stray_segment(node: NodeUnderTest) -> None:
    """Segment without a transfer: 05040001h."""
    node.dialogue.send(0x600 + node.dialogue.node_id, b"\x80".ljust(8, b"\0"))
    node.dialogue.refusal(b"\x60".ljust(8, b"\0"), AbortCode.INVALID_COMMAND)


@clause("CiA 301 7.2.4")
def unknown_specifier(node: NodeUnderTest) -> None:
    """Command specifier that does not exist: 05040001h."""
    node.dialogue.refusal(b"\xe0".ljust(8, b"\0"), AbortCode.INVALID_COMMAND)


@clause("CiA 301 7.2.4")
def abort_of_the_client(node: NodeUnderTest) -> None:
    """The client's abort ends a transfer and is not answered."""
    dialogue = node.dialogue
    node.variable(0x1008)
    dialogue.initiate(0x40, 0x1008, 0)
    dialogue.send(0x600 + dialogue.node_id, INITIATE.pack(0x80, 0x1008, 0, 0x0800_0000))
    dialogue.silence(0x580 + dialogue.node_id)
    dialogue.refusal(b"\x60".ljust(8, b"\0"), AbortCode.INVALID_COMMAND)


@clause("CiA 301 7.2.4")
def abort_names_the_object(node: NodeUnderTest) -> None:
    """An abort names the object that it is about."""
    answer = node.dialogue.exchange(INITIATE.pack(0x40, 0x1018, 0x7F, 0))
    if answer[:4] != b"\x80\x18\x10\x7f":
        raise Failed(f"answered by {answer.hex(' ')}")


@clause("CiA 301 7.2.4")
def block_upload(node: NodeUnderTest) -> None:
    """Block upload with CRC returns the data of the segmented upload."""
    dialogue = node.dialogue
    node.variable(0x1008)
    expected = dialogue.read(0x1008)
    try:
        first = dialogue.initiate(0xA4, 0x1008, 0, 127)
    except Refused as refusal:
        if refusal.code == NO_BLOCK_TRANSFER:
            raise NotApplicable("the node has no block transfer") from None
        raise
    if first[0] & 0xE0 != 0xC0:
        raise NotApplicable("the node has answered with another protocol, as it may")
    answer_id, data = 0x580 + dialogue.node_id, b""
    dialogue.send(0x600 + dialogue.node_id, b"\xa3".ljust(8, b"\0"))
    for number in range(1, 128):
        segment = dialogue.wait_for(answer_id)
        if segment is None or segment[0] & 0x7F != number:
            raise Failed(f"segment {number} of the block is {segment.hex(' ') if segment else 'missing'}")
        data += segment[1:]
        if segment[0] & 0x80:
            break
    end = accepted(dialogue.exchange(bytes((0xA2, number, 127)).ljust(8, b"\0")))
    dialogue.send(0x600 + dialogue.node_id, b"\xa1".ljust(8, b"\0"))
    data = data[: len(data) - (end[0] >> 2 & 0x7)]
    if data != expected:
        raise Failed(f"{data!r} instead of {expected!r}")
    if first[0] & 0x04 and int.from_bytes(end[1:3], "little") != crc_hqx(data, 0):
        raise Failed("the CRC is wrong")
