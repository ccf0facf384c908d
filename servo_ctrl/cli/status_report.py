"""Status of a running controller as a table, as JSON, and as a line of progress."""

import json
import math
from typing import Any

from rich.console import Console
from rich.table import Table

from servo_ctrl.commands.learning_status import ACTIVE, LearningState, LearningStatus
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.status_fields import axis_rows
from servo_ctrl.commands.texts import on_off
from servo_ctrl.telemetry.mqtt.payloads import functions_document, state_document, to_document
from servo_ctrl.units import MM, UM


def print_status(status: MachineStatus, console: Console) -> None:
    """Print the status as lines and a table with a column for each axis."""
    required_m, learner, adaptation, feed, rapid, *_others = status.settings
    lines = (
        *([f"stopped: {status.reason}"] if status.reason else []),
        f"{status.stage.words}, {status.cycles} cycles, {status.missed_ticks} missed ticks",
        f"learning: {learning_line(status.learning)}",
        f"J required {required_m / UM:g} um, learner {learner}, adaptation {on_off(adaptation)}",
        f"override: feed {feed:g} %, rapid {rapid:g} %, single block {on_off(status.settings.single_block)}",
    )
    for line in lines:
        console.print(line, highlight=False)
    table = Table("axis", *(axis.name for axis in status.axes))
    for label, cells in axis_rows(status.axes):
        table.add_row(label, *cells)
    console.print(table)


def as_json(status: MachineStatus) -> str:
    """Format the retained MQTT state as JSON, with the last reversal and the functions of each axis."""
    document: dict[str, Any] = state_document(status)
    for axis in status.axes:
        # the cycle says when the reversal was
        last = None if axis.last is None else {"cycle": axis.last.cycle, **to_document(axis.last)}
        document["axis"][axis.name] |= {"functions": functions_document(axis), "last_reversal": last}
    return json.dumps(document, indent=2)


def learning_line(learning: LearningStatus) -> str:
    """Return state and progress of a learning run, in one line."""
    state = learning.state.name.lower()
    if not learning.planned or learning.state is LearningState.IDLE:
        return ": ".join(text for text in (state, learning.reason) if text)
    line = f"{state}, axis {learning.axis}, {learning.strokes_done} of {learning.strokes_total} strokes"
    if learning.state in ACTIVE:
        best = f"best J {learning.best_m / UM:.2f} um, " if learning.best_m >= 0.0 else ""
        at_m_s2 = learning.acceleration_m_s2
        at = "" if math.isnan(at_m_s2) else f", {at_m_s2 / MM:g} mm/s2"
        line += f" ({learning.stage}{at}), {best}{learning.remaining_s:.0f} s of machine time to go"
    return f"{line}: {learning.reason}" if learning.reason not in {"", state} else line
