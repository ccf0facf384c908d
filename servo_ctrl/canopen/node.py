"""The controller as a CANopen node: identity, heartbeat, errors, and its commands by SDO.

Entries come from the EDS; docs/commands.md explains them. Once SYNC runs, heartbeat and status TPDO are timed
in SYNC cycles, so that they keep simulated time in lockstep. Before, the supervisor calls `send_heartbeat` by
the wall clock, and there is no PDO.
"""

import socket
import time
from binascii import crc32
from collections.abc import Callable, Mapping

from servo_ctrl.canopen.command_objects import CommandObjects
from servo_ctrl.canopen.dictionary import Dictionary
from servo_ctrl.canopen.errors import AbortCode, EdsError, SdoAbort
from servo_ctrl.canopen.nmt import STATE_AFTER, NmtCommand, NmtState
from servo_ctrl.canopen.own_settings import RESTORE, STORE, OwnSettings
from servo_ctrl.canopen.sdo_server import SdoServer
from servo_ctrl.canopen.settings import HEARTBEATS_MISSED
from servo_ctrl.canopen.stack import Eds, Network, load_eds
from servo_ctrl.canopen.status_mapping import StatusMapping
from servo_ctrl.canopen.status_tpdo import SUBINDICES, StatusTpdo, TpdoSettings
from servo_ctrl.canopen.watch import EMCY_FRAME
from servo_ctrl.commands import controller_objects as o
from servo_ctrl.commands.eds_sections import eds_of
from servo_ctrl.commands.handler import CommandHandler
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.errors import ConfigError

EMCY_RESET = 0x0000
EMCY_GENERIC = 0x1000
EMCY_HEARTBEAT = 0x8130
EMCY_PDO_TIMEOUT = 0x8250
EMCY_FOLLOWING_ERROR = 0x8611
"""Emergency error codes of CiA 301 and CiA 402."""
GENERIC_ERROR = 0x01
"""Bit of the error register (1001h) that any error sets."""
IDENTITY, SERIAL_NUMBER = 0x1018, 4
"""Identity object (CiA 301) and the subindex of its serial number."""
STORE_EDS = 0x1021
"""Object from which a client reads our EDS (CiA 301)."""
SEGMENTS_PER_CYCLE = 1
"""Segments of an SDO block upload sent in a SYNC cycle: 14 % of the bus at 1 kHz and 1 Mbit/s; chosen."""
ERROR_HISTORY_SIZE = 8
"""Entries of 1003h in our EDS."""
ERROR_REGISTER, ERROR_HISTORY, SYNC_PERIOD, CONSUMERS, HEARTBEAT = 0x1001, 0x1003, 0x1006, 0x1016, 0x1017
CONSUMERS_MAX = 8
"""Entries of 1016h in our EDS."""


def load_own_eds(machine: MachineConfig) -> Eds:
    """Load our own EDS. Raises ConfigError naming the machine file and the EDS."""
    path = machine.controller.eds
    try:
        eds = load_eds(path, machine.controller.node_id)
    except EdsError as error:
        raise ConfigError(machine.source, "controller.eds", str(error)) from None
    present = {index for index, _ in eds.variables}
    for index in (ERROR_REGISTER, ERROR_HISTORY, CONSUMERS, HEARTBEAT, o.STATUS_TPDO, o.COMMAND, o.LEARNING):
        if index not in present:
            raise ConfigError(machine.source, "controller.eds", f"{path}: object {index:04X}h is missing")
    return eds


class ControllerNode:
    """Our node on `network`; its objects read status from `handler` and pass commands to it."""

    def __init__(
        self,
        network: Network,
        machine: MachineConfig,
        handler: CommandHandler,
        stored: Mapping[str, int] | None = None,
        store: Callable[[dict[str, int] | None], None] = lambda _values: None,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """`stored`: settings of an earlier run; `store` writes those of this one (1010h, 1011h).

        `now_s`: monotonic clock for the timeout of block transfers, seconds.
        """
        eds = load_own_eds(machine)
        self._network = network
        self._node_id = machine.controller.node_id
        self._period_s = machine.period_s
        self._state = NmtState.INITIALISING
        self._countdown = 0
        self._register = 0
        self._errors: list[int] = []
        self._last_error = ""
        settings = dict(stored or {})
        self._default_heartbeat_ms = settings.pop("heartbeat_ms", machine.controller.heartbeat_ms) & 0xFFFF
        self._heartbeat_ms = self._default_heartbeat_ms
        dictionary = Dictionary(eds)
        self._objects = CommandObjects(handler, tuple(machine.axes), dictionary)
        defaults = TpdoSettings(*(eds.default(o.STATUS_TPDO, subindex) or 0 for subindex in SUBINDICES))
        self._tpdo = StatusTpdo(defaults.with_stored(settings), machine.period_s, self._send_status)
        self._mapping = StatusMapping(
            eds, o.STATUS_MAPPING, self._objects.fields, lambda: self._tpdo.is_on, settings
        )
        self._settings = OwnSettings(self._present_settings, store)
        self._connect_objects(dictionary, eds, machine)
        self._server = SdoServer(
            dictionary, lambda answer: network.send_message(0x580 + self._node_id, answer), now_s
        )
        network.subscribe(0x600 + self._node_id, self._on_sdo)
        network.subscribe(0x000, self._on_nmt)

    def _connect_objects(self, dictionary: Dictionary, eds: Eds, machine: MachineConfig) -> None:
        """Give the communication objects their readers and writers."""
        eds_text = eds_of(machine.controller.eds.read_text(encoding="utf-8"), len(machine.axes)).encode()
        consumers, serial = _consumers(machine), _serial_number(machine)
        dictionary.readers |= {
            IDENTITY: lambda sub: serial if sub == SERIAL_NUMBER else eds.default(IDENTITY, sub) or 0,
            ERROR_REGISTER: lambda _sub: self._register,
            ERROR_HISTORY: self._read_history,
            SYNC_PERIOD: lambda _sub: machine.bus.sync_period_us,
            CONSUMERS: lambda sub: consumers[sub],
            HEARTBEAT: lambda _sub: self._heartbeat_ms,
            o.STATUS_TPDO: self._tpdo.read,
            o.STATUS_MAPPING: self._mapping.read,
            o.LAST_ERROR: lambda _sub: self._last_error,
            STORE: self._settings.read,
            RESTORE: self._settings.read,
            STORE_EDS: lambda _sub: eds_text,
        }
        dictionary.writers |= {
            ERROR_HISTORY: self._clear_history,
            HEARTBEAT: self._set_heartbeat,
            o.STATUS_TPDO: self._tpdo.write,
            o.STATUS_MAPPING: self._mapping.write,
            STORE: self._settings.store,
            RESTORE: self._settings.restore,
        }

    def boot_up(self) -> None:
        """Send our boot-up message and become pre-operational; before, the node sends nothing."""
        self._network.send_message(0x700 + self._node_id, bytes((NmtState.INITIALISING,)))
        self._state = NmtState.PRE_OPERATIONAL

    def operational(self, running: bool) -> None:
        """Enter NMT operational, which sends the status TPDO with the next cycle, or pre-operational."""
        if running:
            self._tpdo.announce()
        elif self._state is NmtState.OPERATIONAL:
            self._tpdo.flush()
        self._state = NmtState.OPERATIONAL if running else NmtState.PRE_OPERATIONAL

    @property
    def heartbeat_s(self) -> float:
        """Producer heartbeat time, seconds; 0: none. A client may change it by 1017h."""
        return self._heartbeat_ms * 1e-3 if self._state is not NmtState.INITIALISING else 0.0

    def send_heartbeat(self) -> None:
        """Send a heartbeat now, unless they are off."""
        if self.heartbeat_s:
            self._network.send_message(0x700 + self._node_id, bytes((self._state,)))

    def count_cycles(self, elapsed: int) -> None:
        """Count `elapsed` SYNC periods; send heartbeat and status TPDO when they are due."""
        self._countdown -= elapsed
        if self._countdown <= 0:
            self._countdown = max(round((self.heartbeat_s or 1.0) / self._period_s), 1)
            self.send_heartbeat()
        if self._state is NmtState.OPERATIONAL:
            self._tpdo.count_cycles(elapsed)
        self._server.paced = True
        self._server.send_pending(SEGMENTS_PER_CYCLE)

    def announce(self) -> None:
        """Announce a change of status: the TPDO is sent with the next cycle, once for several changes."""
        self._tpdo.announce()

    def report_error(self, code: int, text: str) -> None:
        """Enter an error into 1001h, 1003h and 2001h and send it as EMCY. `code`: error code of CiA."""
        self._register |= GENERIC_ERROR
        self._errors = [code, *self._errors][:ERROR_HISTORY_SIZE]
        self._last_error = text
        self._send_emcy(code)

    def clear_error(self) -> None:
        """Clear 1001h and send EMCY "error reset"; 1003h and 2001h keep the error."""
        self._register = 0
        self._send_emcy(EMCY_RESET)

    def start(self, node_id: int) -> None:
        """Command another node to NMT operational."""
        self._network.send_message(0x000, bytes((NmtCommand.START, node_id)))

    def _send_emcy(self, code: int) -> None:
        self._network.send_message(0x080 + self._node_id, EMCY_FRAME.pack(code, self._register))

    def _send_status(self, cob_id: int) -> None:
        self._network.send_message(cob_id, self._objects.payload(self._mapping.places))

    def _on_sdo(self, can_id: int, payload: bytearray, timestamp_s: float) -> None:
        if self._state not in {NmtState.INITIALISING, NmtState.STOPPED}:
            self._server.on_request(can_id, payload, timestamp_s)

    def _on_nmt(self, _can_id: int, payload: bytearray, _timestamp_s: float) -> None:
        """Obey another NMT master, for our node only: motion is commanded through `handler`."""
        if len(payload) != 2 or payload[1] not in {0, self._node_id} or self._state is NmtState.INITIALISING:
            return
        if payload[0] in {NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION}:
            # the controller does not restart; its communication parameters return to their defaults
            self._server.drop_transfer()
            self._heartbeat_ms = self._default_heartbeat_ms
            self._tpdo.reset()
            self._mapping.reset()
            self.boot_up()
        else:
            self._state = STATE_AFTER.get(payload[0], self._state)

    def _present_settings(self) -> dict[str, int]:
        """Return the settings that a client can change, as 1010h stores them."""
        own = {"heartbeat_ms": self._heartbeat_ms, **self._tpdo.settings._asdict()}
        return {**own, **self._mapping.settings()}

    def _read_history(self, subindex: int) -> int:
        errors = (len(self._errors), *self._errors)
        return errors[subindex] if subindex < len(errors) else 0

    def _clear_history(self, _subindex: int, value: int) -> None:
        if value:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        self._errors = []

    def _set_heartbeat(self, _subindex: int, value: int) -> None:
        self._heartbeat_ms = value
        self._countdown = 0


def _serial_number(machine: MachineConfig) -> int:
    """Return a serial number derived from the computer and the machine, never 0."""
    return crc32(f"{socket.gethostname()} {machine.machine.name}".encode()) or 1


def _consumers(machine: MachineConfig) -> tuple[int, ...]:
    """Return the entries of 1016h: the nodes whose heartbeat we consume, and the consumer time."""
    nodes = [axis.drive.node_id for axis in machine.axes.values()]
    nodes += [axis.scale.node_id for axis in machine.axes.values() if axis.scale is not None]
    time_ms = min(machine.controller.heartbeat_ms * HEARTBEATS_MISSED, 0xFFFF)
    entries = [node_id << 16 | time_ms for node_id in nodes[:CONSUMERS_MAX]]
    return (CONSUMERS_MAX, *entries, *(CONSUMERS_MAX - len(entries)) * (0,))
