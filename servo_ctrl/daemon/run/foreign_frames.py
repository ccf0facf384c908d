"""Detects frames that only this controller may send: a duplicate master, and SDO writes to its nodes."""

from collections.abc import Callable, Sequence
from functools import partial

from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.io.can_port import CanPort

SYNC_COB_ID = 0x080
LISTENING_S = 0.25
"""Time to listen before sending: longer than the longest SYNC period and two usual heartbeats."""
FIRST_TPDO = 0x1800
"""Index of the first TPDO's communication parameters; those of RPDOs are below it (CiA 301)."""
SDO_REQUEST = 0x600
DOWNLOADS = {1, 6}
"""Client command specifiers that begin a download: initiate, and initiate block."""
SDO_BYTES = 8
SDO_RESPONSE = 0x580
SDO_ABORT = 0x80
"""Command specifier of an abort (CiA 301)."""


def report_masters(
    config: MachineConfig, plans: Sequence[NodePlan], port: CanPort, report: Callable[[str], object]
) -> None:
    """Call `report` from now on for every received frame that only this controller may send."""
    node_id = config.controller.node_id
    ours = {SYNC_COB_ID: "SYNC", 0x700 + node_id: f"heartbeats with this controller's node id {node_id}"}
    for plan in plans:
        for pdo in plan.pdos:
            if pdo.communication < FIRST_TPDO:
                ours[pdo.cob_id] = f"set points for {plan.key}"
    for can_id, what in ours.items():
        text = f"bus {port.name}: another controller sends {what}; only one may run"
        port.handlers[can_id] = partial(_on_foreign, report, text)


def _on_foreign(report: Callable[[str], object], text: str, _payload: bytes, _timestamp_s: float) -> None:
    report(text)


def report_writes(plans: Sequence[NodePlan], port: CanPort, report: Callable[[int, str], None]) -> None:
    """Call `report` with a node's index for every accepted SDO download to it by another participant.

    After an accepted download the objects that the boot checked and wrote are uncertain; a refused download
    changes nothing. The port does not receive our own frames.
    """
    for place, plan in enumerate(plans):
        watch = _WriteWatch(plan, port, partial(report, place))
        port.handlers[SDO_REQUEST + plan.node_id] = watch.on_request
        port.handlers[SDO_RESPONSE + plan.node_id] = watch.on_response


class _WriteWatch:
    """Reports downloads to one node: remembers the request, reports at the response that accepts it."""

    def __init__(self, plan: NodePlan, port: CanPort, report: Callable[[str], None]) -> None:
        self._plan, self._port, self._report = plan, port, report
        self._address = b""
        """Index and subindex of the download that awaits its response."""

    def on_request(self, payload: bytes, _timestamp_s: float) -> None:
        if len(payload) == SDO_BYTES and payload[0] >> 5 in DOWNLOADS:
            self._address = bytes(payload[1:4])

    def on_response(self, payload: bytes, timestamp_s: float) -> None:
        if self._address and bytes(payload[1:4]) == self._address:
            address, self._address = self._address, b""
            if payload[0] != SDO_ABORT:
                self._report_write(int.from_bytes(address[:2], "little"), address[2])
        self._port.fallback(SDO_RESPONSE + self._plan.node_id, bytearray(payload), timestamp_s)

    def _report_write(self, index: int, subindex: int) -> None:
        variable = self._plan.eds.variables.get((index, subindex))
        name = f" ({variable.name})" if variable is not None else ""
        self._report(f"{self._plan.name}: another participant writes {index:04X}h:{subindex:02X}{name}")
