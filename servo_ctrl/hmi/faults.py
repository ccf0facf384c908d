"""Everything that keeps the machine from working now, with what to do about it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from servo_ctrl.hmi.advice import Advice, of_code, of_reason
from servo_ctrl.hmi.stages import is_fault

if TYPE_CHECKING:
    from collections.abc import Iterator

    from servo_ctrl.config.local_status import DriveState, Status

_STOPPED = frozenset({"stopping", "quick_stopping", "disabling", "off", "standby"})
_UNDER_WAY = frozenset({"starting", "ready", "running"})
_EMCY = re.compile(r"EMCY ([0-9A-F]{4})h")
NODE_SILENT = Advice("A node is not in operation", "Has it power? Check its bus cable; see page Bus.")


class Fault(NamedTuple):
    """One line of the list of faults."""

    where: str
    advice: Advice
    detail: str
    """As the machine says it."""


def faults_of(status: Status) -> list[Fault]:
    """The faults, the machine's own reason first."""
    return [*_of_machine(status), *_of_drives(status), *_of_nodes(status)]


def _of_machine(status: Status) -> Iterator[Fault]:
    if status.stage in _STOPPED and is_fault(status.reason):
        code = _EMCY.search(status.reason)
        advice = of_code(int(code[1], 16)) if code else of_reason(status.reason)
        yield Fault("Machine", advice, status.reason)


def _of_drives(status: Status) -> Iterator[Fault]:
    for drive in status.drives:
        if drive.error_code is not None:
            yield Fault(_axis(drive), of_code(drive.error_code), f"error code {drive.error_code:04X}h")
        elif drive.state in {"fault", "fault reaction active"}:
            yield Fault(_axis(drive), of_code(0x1000), f"drive state: {drive.state}")


def _axis(drive: DriveState) -> str:
    return f"Axis {drive.axis.upper()}"


def _of_nodes(status: Status) -> Iterator[Fault]:
    if status.stage in _UNDER_WAY:
        for node in status.nodes:
            if node.nmt_state != "operational":
                yield Fault(
                    node.name, NODE_SILENT, f"node {node.node_id}: {node.nmt_state.replace('_', ' ')}"
                )
