"""Clauses about the object dictionary and the EDS (CiA 301 7.5, CiA 306)."""

from servo_ctrl.canopen.errors import AbortCode
from servo_ctrl.conformance.clauses import OUT_OF_RANGE, NodeUnderTest, clause, size_of
from servo_ctrl.conformance.dialogue import Failed, Refused


@clause("CiA 306-1")
def every_object(node: NodeUnderTest) -> None:
    """Every readable object of the EDS exists, in the length of its type."""
    for (index, subindex), variable in sorted(node.eds.variables.items()):
        if index < 0x1000 or variable.access == "wo" or not (size := size_of(variable)):
            continue
        try:
            found = node.dialogue.read(index, subindex)
        except Refused as refusal:
            if refusal.code == AbortCode.NO_DATA or index == 0x1003:
                continue
            raise Failed(f"{index:04X}h:{subindex:02X} is {refusal}") from None
        if len(found) != size:
            raise Failed(f"{index:04X}h:{subindex:02X} has {len(found)} bytes, its type {size}")


@clause("CiA 306-1")
def constants(node: NodeUnderTest) -> None:
    """Constants are those of the EDS."""
    for (index, subindex), variable in sorted(node.eds.variables.items()):
        if variable.access == "const" and isinstance(variable.default, int) and (size := size_of(variable)):
            found, expected = node.dialogue.number(index, subindex), variable.default % (1 << 8 * size)
            if found != expected:
                raise Failed(f"{index:04X}h:{subindex:02X} is {found}, the EDS says {expected}")


@clause("CiA 301 7.5.2")
def identity(node: NodeUnderTest) -> None:
    """1018h identity is that of the EDS, where that states it."""
    for subindex in (1, 2, 3):
        stated = node.eds.default(0x1018, subindex)
        if stated and (found := node.dialogue.number(0x1018, subindex)) != stated:
            raise Failed(f"1018h:{subindex:02X} is {found:08X}h, the EDS says {stated:08X}h")


@clause("CiA 301 7.5.2")
def emergency_identifier(node: NodeUnderTest) -> None:
    """1014h EMCY identifier is 80h + node id."""
    node.variable(0x1014)
    found = node.dialogue.number(0x1014)
    if found & 0x7FF != 0x80 + node.dialogue.node_id:
        raise Failed(f"1014h is {found:08X}h")


@clause("CiA 301 7.5.2")
def error_history(node: NodeUnderTest) -> None:
    """1003h accepts no number of errors but 0."""
    node.variable(0x1003)
    node.dialogue.refused_write(0x1003, 0, b"\1", *OUT_OF_RANGE)
    node.dialogue.write(0x1003, 0, b"\0")


@clause("CiA 301 7.5.2")
def store_signature(node: NodeUnderTest) -> None:
    """1010h stores nothing without its signature."""
    node.variable(0x1010, 1)
    node.dialogue.refused_write(0x1010, 1, b"safe")


@clause("CiA 301 7.5.2")
def restore_signature(node: NodeUnderTest) -> None:
    """1011h restores nothing without its signature."""
    node.variable(0x1011, 1)
    node.dialogue.refused_write(0x1011, 1, b"lode")
