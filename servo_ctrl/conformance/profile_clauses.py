"""Clauses of device profiles: CiA 402 drives, as far as they need no power, and CiA 406 encoders."""

from servo_ctrl.conformance.clauses import NodeUnderTest, clause
from servo_ctrl.conformance.dialogue import Dialogue, Failed, NotApplicable, Refused


def _drive(node: NodeUnderTest) -> Dialogue:
    if (node.eds.default(0x1000) or 0) & 0xFFFF != 402:
        raise NotApplicable("no CiA 402 drive")
    return node.dialogue


@clause("CiA 402-2")
def ready(node: NodeUnderTest) -> None:
    """Statusword and controlword: ready to switch on, and back, without power."""
    dialogue = _drive(node)
    if dialogue.number(0x6041) & 0x4F != 0x40:
        raise NotApplicable("the drive is not in switch on disabled")
    for word, mask, state in ((0x06, 0x6F, 0x21), (0x00, 0x4F, 0x40)):
        dialogue.write(0x6040, 0, bytes((word, 0)))
        if (found := dialogue.number(0x6041)) & mask != state:
            raise Failed(f"after controlword {word:04X}h the statusword is {found:04X}h")


@clause("CiA 402-2")
def unsupported_mode(node: NodeUnderTest) -> None:
    """A mode that 6502h does not announce is refused or ignored."""
    dialogue = _drive(node)
    supported = dialogue.number(0x6502)
    absent = next((mode for mode in range(1, 11) if not supported >> mode - 1 & 1), None)
    if absent is None:
        raise NotApplicable("6502h announces all")
    before = dialogue.read(0x6060)
    try:
        dialogue.write(0x6060, 0, bytes((absent,)))
    except Refused:
        return
    shown = dialogue.number(0x6061)
    dialogue.write(0x6060, 0, before)
    if shown == absent:
        raise Failed(f"6061h shows mode {absent}, which 6502h = {supported:X}h does not announce")


@clause("CiA 406")
def encoder(node: NodeUnderTest) -> None:
    """Position value 6004h exists, and 6501h has the measuring steps."""
    if (node.eds.default(0x1000) or 0) & 0xFFFF != 406:
        raise NotApplicable("no CiA 406 encoder")
    node.dialogue.read(0x6004)
    if not node.dialogue.number(0x6501):
        raise Failed("6501h is 0")
