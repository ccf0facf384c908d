"""NMT slave: states, boot-up, heartbeat producer 1017h, by the time of the bench."""

from collections.abc import Callable
from enum import IntEnum

from hil_sim.node.dictionary import Dictionary
from hil_sim.node.lss_slave import UNNAMED

NEVER_US = 1 << 62
"""A time that is never reached: no timer runs."""


class Clock:
    """The bench's time, set by the runner: simulated in lockstep, elapsed in real time."""

    __slots__ = ("now_us",)

    def __init__(self) -> None:
        self.now_us = 0


class NmtState(IntEnum):
    """NMT states, by their values in a heartbeat."""

    INITIALISING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


class NmtCommand(IntEnum):
    """Command specifiers of the NMT master."""

    START = 1
    STOP = 2
    ENTER_PRE_OPERATIONAL = 128
    RESET_NODE = 129
    RESET_COMMUNICATION = 130


TARGETS = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}


class NmtSlave:
    """NMT state of one node; calls `on_state(new)` and `on_reset(whole)`.

    After a reset the node boots by itself into pre-operational.
    """

    def __init__(
        self,
        dictionary: Dictionary,
        clock: Clock,
        send: Callable[[int, bytes], None],
        on_state: Callable[[NmtState], None],
        on_reset: Callable[[bool], None],
    ) -> None:
        self._dictionary = dictionary
        self._clock = clock
        self._send = send
        self._on_state = on_state
        self._on_reset = on_reset
        self.cob_id = 0x700 + dictionary.node_id
        self._period_us = 0
        self.state = NmtState.INITIALISING
        self.alive = True
        self.due_us = NEVER_US
        dictionary.followers[0x1017] = self._follow_period

    def boot(self) -> None:
        """Send the boot-up message and enter pre-operational; a node without an id stays initialising."""
        self.state = NmtState.INITIALISING
        self.cob_id = 0x700 + self._dictionary.node_id
        if self._dictionary.node_id == UNNAMED:
            return
        self._follow_period(0)
        self._send(self.cob_id, b"\0")
        self.enter(NmtState.PRE_OPERATIONAL)

    def on_command(self, data: bytes) -> None:
        """Execute an NMT frame that addresses this node or all."""
        if (
            not self.alive
            or self.state == NmtState.INITIALISING
            or len(data) != 2
            or data[1] not in {0, self._dictionary.node_id}
        ):
            return
        try:
            command = NmtCommand(data[0])
        except ValueError:
            return
        if command in TARGETS:
            self.enter(TARGETS[command])
            return
        self._on_reset(command == NmtCommand.RESET_NODE)
        self.boot()

    def enter(self, state: NmtState) -> None:
        """Change the state and call `on_state`."""
        if state != self.state:
            self.state = state
            self._on_state(state)

    def run(self) -> None:
        """Send the heartbeat that is due."""
        if self._clock.now_us >= self.due_us:
            self._send(self.cob_id, bytes((self.state,)))
            late_us = self._clock.now_us - self.due_us
            self.due_us += self._period_us * (1 + late_us // self._period_us)

    def _follow_period(self, _subindex: int) -> None:
        self._period_us = 1000 * self._dictionary.value(0x1017)
        self.due_us = self._clock.now_us + self._period_us if self._period_us else NEVER_US
