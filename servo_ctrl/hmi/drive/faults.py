"""The faults that keep the machine from working now, each with the advice of advice.toml."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.machine_stage import is_fault
from servo_ctrl.hmi.shell.overload import REMEDY, TOO_MANY, missed_share

_EMCY = re.compile(r"EMCY ([0-9A-F]{4})h")
_GENERIC_ERROR = 0x1000
"""Error code of CiA 301 for a fault without a code of its own."""


class Advice(NamedTuple):
    """A problem in plain words, and what the operator can do about it."""

    problem: str
    remedy: str


class Fault(NamedTuple):
    """One fault."""

    where: str
    advice: Advice
    detail: str
    """The controller's own words."""


_TEXTS = tomllib.loads(Path(__file__).with_name("advice.toml").read_text(encoding="utf-8"))
CODES, REASONS, _UNKNOWN = (
    {key: Advice(*texts) for key, texts in _TEXTS[section].items()}
    for section in ("code", "reason", "unknown")
)
UNKNOWN_CODE, UNKNOWN_REASON = _UNKNOWN["code"], _UNKNOWN["reason"]
NODE_NOT_OPERATIONAL = Advice(
    word("A node is not in operation"), word("Has it power? Check its bus cable; see page Bus.")
)

COMPUTER_BUSY = Advice(word("It was too busy to control the axes"), REMEDY)


def advice_for_code(code: int) -> Advice:
    """Return the advice for an error code of 16 bits, by the longest entry that fits."""
    digits = f"{code:04X}"
    return next((CODES[digits[:length]] for length in (4, 3, 2, 1) if digits[:length] in CODES), UNKNOWN_CODE)


def advice_for_reason(reason: str) -> Advice:
    """Return the advice for the reason of a stop, in the controller's words, by the first entry that fits."""
    return next((advice for part, advice in REASONS.items() if part in reason), UNKNOWN_REASON)


def faults_in(status: MachineStatus) -> Iterator[Fault]:
    """Yield the faults of machine, drives and nodes; the likeliest cause first, then the stop's reason."""
    stopped_by_itself = status.stage.stopped and is_fault(status.reason)
    if stopped_by_itself and missed_share(status) >= TOO_MANY:
        missed = tr(
            "{missed} of {cycles} ticks were missed; likely the cause of the faults below",
            missed=status.missed_ticks,
            cycles=status.cycles,
        )
        yield Fault(tr("Computer"), COMPUTER_BUSY, missed)
    if stopped_by_itself:
        code = _EMCY.search(status.reason)
        advice = advice_for_code(int(code[1], 16)) if code else advice_for_reason(status.reason)
        yield Fault(tr("Machine"), advice, status.reason)
    for drive in status.drives:
        axis = tr("Axis {axis}", axis=drive.axis.upper())
        if drive.error_code is not None:
            yield Fault(
                axis, advice_for_code(drive.error_code), tr("error code {code:04X}h", code=drive.error_code)
            )
        elif drive.state in {"fault", "fault reaction active"}:
            yield Fault(axis, advice_for_code(_GENERIC_ERROR), tr("drive state: {state}", state=drive.state))
    for node in status.nodes:
        if status.stage.under_way and node.nmt_state != "operational":
            detail = f"node {node.node_id}: {node.nmt_state.replace('_', ' ')}"
            yield Fault(node.name, NODE_NOT_OPERATIONAL, detail)
