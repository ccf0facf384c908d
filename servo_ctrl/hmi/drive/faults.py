"""The faults that keep the machine from working now, each with advice."""

import re
from collections.abc import Iterator
from typing import NamedTuple

from servo_ctrl.commands.machine_status import DriveStatus, MachineStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.drive.advice import Advice, advice_for_code, advice_for_reason
from servo_ctrl.hmi.shell.machine_stage import is_fault

_STOPPED = frozenset({Stage.STOPPING, Stage.QUICK_STOPPING, Stage.DISABLING, Stage.OFF, Stage.STANDBY})
_UNDER_WAY = frozenset({Stage.STARTING, Stage.READY, Stage.RUNNING})
_EMCY = re.compile(r"EMCY ([0-9A-F]{4})h")
_GENERIC_ERROR = 0x1000
"""Error code of CiA 301 for a fault without a code of its own."""
NODE_SILENT = Advice("A node is not in operation", "Has it power? Check its bus cable; see page Bus.")


class Fault(NamedTuple):
    """One fault."""

    where: str
    advice: Advice
    detail: str
    """The controller's own words."""


def faults_in(status: MachineStatus) -> list[Fault]:
    """The faults of machine, drives and nodes, the reason of the stop first."""
    return [*_machine_faults(status), *_drive_faults(status), *_node_faults(status)]


def _machine_faults(status: MachineStatus) -> Iterator[Fault]:
    if status.stage in _STOPPED and is_fault(status.reason):
        code = _EMCY.search(status.reason)
        advice = advice_for_code(int(code[1], 16)) if code else advice_for_reason(status.reason)
        yield Fault("Machine", advice, status.reason)


def _drive_faults(status: MachineStatus) -> Iterator[Fault]:
    for drive in status.drives:
        if drive.error_code is not None:
            detail = f"error code {drive.error_code:04X}h"
            yield Fault(_axis(drive), advice_for_code(drive.error_code), detail)
        elif drive.state in {"fault", "fault reaction active"}:
            yield Fault(_axis(drive), advice_for_code(_GENERIC_ERROR), f"drive state: {drive.state}")


def _axis(drive: DriveStatus) -> str:
    return f"Axis {drive.axis.upper()}"


def _node_faults(status: MachineStatus) -> Iterator[Fault]:
    if status.stage in _UNDER_WAY:
        for node in status.nodes:
            if node.nmt_state != "operational":
                detail = f"node {node.node_id}: {node.nmt_state.replace('_', ' ')}"
                yield Fault(node.name, NODE_SILENT, detail)
