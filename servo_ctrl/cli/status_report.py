"""What a running controller tells, as a table, as JSON, and as a line of progress."""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from rich.table import Table

from servo_ctrl.axis.fault_policy import Stage
from servo_ctrl.config.desk import LEARNERS, LearningState, Setting
from servo_ctrl.telemetry.mqtt_payloads import learned_payload, reversal_payload, state_payload

if TYPE_CHECKING:
    from rich.console import Console

    from servo_ctrl.config.desk import AxisStatus, DeskStatus, LearningStatus, ScrewStatus

UM, MM = 1e-6, 1e-3
ROWS = (
    "pulse",
    "observer",
    "learning due",
    "reversals",
    "J, um",
    "peak, um",
    "RMS, um",
    "contour peak, um",
    "at, mm/s2",
    "functions",
    "learned at",
    "J before, um",
    "J after, um",
    "screw",
    "screw table",
    "lost motion, um",
    "screw J before, um",
    "screw J after, um",
)


def print_status(status: DeskStatus, console: Console) -> None:
    """For a reader."""
    stage = Stage(status.stage).name.lower().replace("_", " ")
    settings = status.settings
    learner = LEARNERS[int(settings[Setting.LEARNER])]
    adaptation = "on" if settings[Setting.ADAPTATION] else "off"
    lines = (
        *([f"stopped: {status.reason}"] if status.reason else []),
        f"{stage}, {status.cycles} cycles, {status.missed_ticks} missed ticks",
        f"learning: {learning_line(status.learning)}",
        f"J required {settings[Setting.REQUIRED_M] / UM:g} um, learner {learner}, adaptation {adaptation}",
    )
    for line in lines:
        console.print(line, highlight=False)
    table = Table("axis", *(axis.name for axis in status.axes))
    for row in zip(ROWS, *map(_column, status.axes), strict=True):
        table.add_row(*row)
    console.print(table)


def as_json(status: DeskStatus) -> str:
    """As the retained state over MQTT has it, with the last reversal and the functions of each axis."""
    document: dict[str, Any] = json.loads(state_payload(status, 0))
    del document["reversals_dropped"]
    for axis in status.axes:
        told = document["axis"][axis.name]
        told["functions"] = json.loads(learned_payload(status.cycles, axis))["functions"]
        told["last_reversal"] = None
        if axis.last is not None:
            told["last_reversal"] = json.loads(reversal_payload(axis.last, datetime.now(UTC)))
            del told["last_reversal"]["time"]  # its cycle says when it was
    return json.dumps(document, indent=2)


def learning_line(learning: LearningStatus) -> str:
    """Where a learning run is, in one line."""
    state, outlook = LearningState(learning.state).name.lower(), learning.outlook
    if outlook is None or learning.state is LearningState.IDLE:
        return ": ".join(text for text in (state, learning.reason) if text)
    line = f"{state}, axis {learning.axis}, {outlook.strokes_done} of {outlook.strokes_total} strokes"
    if learning.state in {LearningState.RUNNING, LearningState.PAUSING, LearningState.PAUSED}:
        best = f"best J {outlook.best_m / UM:.2f} um, " if outlook.best_m >= 0.0 else ""
        at = "" if math.isnan(outlook.acceleration_m_s2) else f", {outlook.acceleration_m_s2 / MM:g} mm/s2"
        line += f" ({outlook.stage}{at}), {best}{outlook.remaining_s:.0f} s of machine time to go"
    return f"{line}: {learning.reason}" if learning.reason not in {"", state} else line


def _column(axis: AxisStatus) -> tuple[str, ...]:
    last, learned = axis.last, axis.learned
    reversal: tuple[str, ...] = ("",) * 5
    if last is not None:
        errors_m = (last.error_mean_m, last.error_peak_m, last.error_rms_m, last.contour_peak_m)
        reversal = (*(f"{value / UM:.2f}" for value in errors_m), f"{last.acceleration_m_s2 / MM:g}")
    quality = ("", "")
    if learned is not None:
        quality = (f"{learned.before_m / UM:.2f}", f"{learned.after_m / UM:.2f}")
    switches = ("on" if on else "off" for on in (axis.compensation_enabled, axis.observer_enabled))
    due = "yes" if axis.learning_due else "no"
    version = f"version {axis.version}" if axis.version else "none"
    of_pulse = (*switches, due, str(axis.reversals), *reversal, version, axis.learned_at[:16], *quality)
    return (*of_pulse, *_screw_column(axis.screw))


def _screw_column(screw: ScrewStatus) -> tuple[str, ...]:
    learned = screw.learned
    version = f"version {screw.version}" if screw.version else "none"
    if learned is None:
        return "on" if screw.enabled else "off", version, "", "", ""
    quality = (learned.lost_motion_m, learned.before_m, learned.after_m)
    return "on" if screw.enabled else "off", version, *(f"{value / UM:.2f}" for value in quality)
