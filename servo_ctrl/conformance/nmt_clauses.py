"""Clauses about NMT (CiA 301, 7.2.8): states, heartbeat, boot-up."""

from collections.abc import Callable

from servo_ctrl.conformance.clauses import (
    BOOT_UP_LIMIT_S,
    ENTER_PRE_OPERATIONAL,
    OPERATIONAL,
    PRE_OPERATIONAL,
    RESET_COMMUNICATION,
    START,
    STOP,
    STOPPED,
    NodeUnderTest,
    clause,
)
from servo_ctrl.conformance.dialogue import INITIATE, Failed, NotApplicable


@clause("CiA 301 7.2.8")
def states(node: NodeUnderTest) -> None:
    """NMT states as the heartbeat shows them."""
    node.without_errors()
    with _Heartbeats(node) as shown:
        for command, state in (
            (START, OPERATIONAL),
            (STOP, STOPPED),
            (ENTER_PRE_OPERATIONAL, PRE_OPERATIONAL),
        ):
            node.dialogue.command(command)
            if (found := shown(state)) != state:
                raise Failed(f"after NMT command {command:02X}h the heartbeat shows {found}")


@clause("CiA 301 7.2.8")
def foreign_command(node: NodeUnderTest) -> None:
    """NMT for another node, or of one byte, changes nothing."""
    dialogue = node.dialogue
    with _Heartbeats(node) as shown:
        dialogue.command(START, 127 if dialogue.node_id != 127 else 126)
        dialogue.send(0x000, bytes((START,)))
        if (found := shown(None)) != PRE_OPERATIONAL:
            raise Failed(f"the heartbeat shows {found}")


@clause("CiA 301 7.3.2")
def stopped(node: NodeUnderTest) -> None:
    """A stopped node answers no SDO."""
    dialogue = node.dialogue
    dialogue.command(STOP)
    try:
        dialogue.drop_arrived()
        dialogue.send(0x600 + dialogue.node_id, INITIATE.pack(0x40, 0x1000, 0, 0))
        dialogue.silence(0x580 + dialogue.node_id)
    finally:
        dialogue.command(ENTER_PRE_OPERATIONAL)


@clause("CiA 301 7.2.8")
def boot_up(node: NodeUnderTest) -> None:
    """Reset communication ends in a boot-up message."""
    dialogue = node.dialogue
    dialogue.drop_arrived()
    dialogue.command(RESET_COMMUNICATION)
    frames = (dialogue.wait_for(0x700 + dialogue.node_id, BOOT_UP_LIMIT_S) for _ in range(MAY_BE_LATE + 1))
    frame = next((frame for frame in frames if frame in {b"\0", None}), b"\x7f")
    dialogue.command(ENTER_PRE_OPERATIONAL)  # some nodes start by themselves (1F80h)
    if frame != b"\0":
        raise Failed(f"it sent {frame.hex(' ') if frame is not None else 'nothing'}")


MAY_BE_LATE = 5
"""Heartbeats with the previous state that may still be under way; chosen."""


class _Heartbeats:
    """Context with a heartbeat every 20 ms; entering returns a function that reads the state from heartbeats.

    `shown(None)` returns the state of the next heartbeat. `shown(expected)` skips some heartbeats with
    another state, which may be under way already.
    """

    def __init__(self, node: NodeUnderTest) -> None:
        if "w" not in node.variable(0x1017).access:
            raise NotApplicable("the heartbeat is fixed")
        self._dialogue = node.dialogue

    def __enter__(self) -> Callable[[int | None], int | None]:
        dialogue = self._dialogue
        self._before = dialogue.read(0x1017)
        dialogue.write(0x1017, 0, (20).to_bytes(2, "little"))

        def shown(expected: int | None) -> int | None:
            dialogue.drop_arrived()
            state = None
            for _ in range(1 if expected is None else MAY_BE_LATE):
                frame = dialogue.wait_for(0x700 + dialogue.node_id, BOOT_UP_LIMIT_S)
                state = frame[0] & 0x7F if frame else None
                if state in {None, expected}:
                    break
            return state

        return shown

    def __exit__(self, *_: object) -> None:
        self._dialogue.command(ENTER_PRE_OPERATIONAL)
        self._dialogue.write(0x1017, 0, self._before)
