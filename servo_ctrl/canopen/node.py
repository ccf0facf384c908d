"""The controller as a CANopen node of its own: identity, heartbeat, state and errors for whoever asks.

Entries come from the EDS; what changes is answered live: 1001h, 1003h, 2000h (state), 2001h (last error),
2002h (cycles), 2003h (missed ticks). The heartbeat is counted in SYNC cycles once SYNC runs, so that it
keeps simulated time in lockstep; until then the supervisor calls `send_heartbeat` by the wall clock.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.canopen.errors import EdsError
from servo_ctrl.canopen.settings import HEARTBEATS_MISSED
from servo_ctrl.canopen.stack import Network, local_node, read_dictionary
from servo_ctrl.config.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Callable

    from canopen import ObjectDictionary

    from servo_ctrl.config.model import MachineConfig

EMCY_GENERIC = 0x1000
EMCY_HEARTBEAT = 0x8130
EMCY_PDO_TIMEOUT = 0x8250
EMCY_FOLLOWING_ERROR = 0x8611
GENERIC_ERROR = 0x01
"""Bit of the error register (1001h) that any error sets."""
ERRORS_KEPT = 8
LIVE = (0x1001, 0x1003, 0x1016, 0x1017, 0x2000)
"""What our EDS must have beside the mandatory objects."""
CONSUMERS = 8
"""Entries of 1016h in our EDS."""


def own_dictionary(machine: MachineConfig) -> ObjectDictionary:
    """The object dictionary of our own EDS. Raises ConfigError naming the machine file and the EDS."""
    path = machine.controller.eds
    try:
        dictionary = read_dictionary(path, machine.controller.node_id)
    except EdsError as error:
        raise ConfigError(machine.source, "controller.eds", str(error)) from None
    for index in LIVE:
        if index not in dictionary:
            raise ConfigError(machine.source, "controller.eds", f"{path}: object {index:04X}h is missing")
    return dictionary


class ControllerNode:
    """Our node on `network`. `status` gives (state, cycles, missed ticks) when a client asks for them."""

    def __init__(
        self, network: Network, machine: MachineConfig, status: Callable[[], tuple[int, int, int]]
    ) -> None:
        node_id = machine.controller.node_id
        self._network = network
        self._status = status
        self._heartbeat_id = 0x700 + node_id
        self._cycle_s = machine.period_s
        self._countdown = 0
        self._register = 0
        self._errors: list[int] = []
        self._last_error = ""
        node = local_node(network, node_id, own_dictionary(machine))
        self._node = node
        node.add_read_callback(self._read)
        self._consume_heartbeats(machine)
        node.sdo[0x1017].raw = machine.controller.heartbeat_ms

    def boot_up(self) -> None:
        """Announce ourselves (boot-up message) and become pre-operational."""
        self._node.nmt.state = "INITIALISING"
        self._node.nmt.state = "PRE-OPERATIONAL"

    def operational(self, running: bool) -> None:
        """The NMT state that our heartbeat carries."""
        self._node.nmt.state = "OPERATIONAL" if running else "PRE-OPERATIONAL"

    @property
    def heartbeat_s(self) -> float:
        """Time between heartbeats, seconds; 0 = none. A client may change it by 1017h."""
        frame = self._network.periodic.get(self._heartbeat_id)
        return frame.period_s if frame is not None and frame.active else 0.0

    def send_heartbeat(self) -> None:
        """Send one now, if we have one."""
        frame = self._network.periodic.get(self._heartbeat_id)
        if frame is not None and frame.active:
            self._network.send_message(frame.can_id, frame.data)

    def count_cycles(self, elapsed: int) -> None:
        """Let `elapsed` SYNC periods pass; sends the heartbeat when it is due."""
        self._countdown -= elapsed
        if self._countdown <= 0:
            self._countdown = max(round((self.heartbeat_s or 1.0) / self._cycle_s), 1)
            self.send_heartbeat()

    def report_error(self, code: int, text: str) -> None:
        """Put an error into 1001h, 1003h and 2001h and send it as EMCY. `code` is a CiA error code."""
        self._register |= GENERIC_ERROR
        self._errors = [code, *self._errors][:ERRORS_KEPT]
        self._last_error = text
        self._node.emcy.send(code, self._register)

    def _read(self, *, index: int, subindex: int, **_entry: object) -> int | str | None:
        """The live value of an entry; None lets the library answer from the EDS."""
        if index == 0x1003:
            errors = (len(self._errors), *self._errors)
            return errors[subindex] if subindex < len(errors) else 0
        state, cycles, missed = self._status()
        live: dict[int, int | str] = {
            0x1001: self._register,
            0x2000: state,
            0x2001: self._last_error,
            0x2002: cycles & 0xFFFFFFFF,
            0x2003: missed & 0xFFFFFFFF,
        }
        return live.get(index)

    def _consume_heartbeats(self, machine: MachineConfig) -> None:
        """1016h says whom we watch and for how long."""
        nodes = [axis.drive.node_id for axis in machine.axes.values()]
        nodes += [axis.scale.node_id for axis in machine.axes.values() if axis.scale is not None]
        time_ms = min(machine.controller.heartbeat_ms * HEARTBEATS_MISSED, 0xFFFF)
        for entry, node_id in enumerate(nodes[:CONSUMERS], start=1):
            self._node.set_data(0x1016, entry, (node_id << 16 | time_ms).to_bytes(4, "little"))
