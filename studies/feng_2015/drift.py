"""Friction changes in production: the compensation degrades, learning becomes due, and restores it.

Simulator, hub and controller are processes; this module acts as the operator, by SDO and the status PDO.
"""

import sys
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.hil_rig.simulated_machine import running, simulated_machine
from servo_ctrl.hil_rig.simulated_run import RunError, new_recording
from servo_ctrl.learning.types import Learned
from servo_ctrl.recording.reversal_log import read_reversals
from studies.feng_2015.operator_panel import OperatorPanel, PanelError, PanelStatus

AXIS = "x"
"""Axis whose friction changes."""
PROGRAM_LIMIT_S, LEARNING_LIMIT_S = 200.0, 1500.0
"""Bounds of the waits for the end of the program and of learning."""
MAX_RUNS = 8
"""Bounds the runs of the program until learning is due, or no longer due."""
UM = 1e6


class Instants(NamedTuple):
    """Machine times of the events, seconds."""

    friction_changes_s: float
    due_s: float
    learning_begun_s: float
    learning_done_s: float
    due_cleared_s: float


class Drift(NamedTuple):
    """Events, reversals and learned functions of the whole run."""

    instants: Instants
    required_m: float
    reversals: list[dict[str, Any]]
    """Entries of the reversal log: axis, time_s, error_mean_m (which is J), due and the other indicators."""
    learned: Learned
    version: int
    log_lines: list[str]
    """Lines of the log of the controller about learning and J of the axis."""

    def evaluation_m(self, begin_s: float, end_s: float) -> float:
        """Return the median J of the axis between two instants. Raises RunError without a reversal there."""
        found = [
            entry["error_mean_m"]
            for entry in self.reversals
            if entry["axis"] == AXIS and begin_s <= entry["time_s"] < end_s
        ]
        if not found:
            raise RunError(f"no reversal of {AXIS} between {begin_s:.1f} s and {end_s:.1f} s")
        return float(median(found))

    def parts_m(self) -> dict[str, float]:
        """Return J before the change, after it, and after learning, metres."""
        at = self.instants
        return {
            "compensated": self.evaluation_m(0.0, at.friction_changes_s),
            "friction changed": self.evaluation_m(at.due_s, at.learning_begun_s),
            "learned again": self.evaluation_m(at.learning_done_s, float("inf")),
        }


async def run_drift(
    machine: Path, plant: Path, program: Path, learned: Path, out: Path, on_event: Callable[[str], None]
) -> Drift:
    """Run the study; record into a new folder of `out`, store new functions in `learned`.

    Raises ServoCtrlError where the run fails or an event does not occur.
    """
    config = load_machine(machine)
    directory = new_recording(out, "drift")
    async with simulated_machine(plant, "lockstep") as bus:
        command = [
            str(Path(sys.executable).with_name("servo-ctrl")),
            *("run", "--machine", str(machine), "--bus", bus, "--pacing", "lockstep", "--serve"),
            *("--program", str(program), "--learned", str(learned), "--record", str(directory)),
        ]
        async with running("the controller", command, "running") as printed:
            learning_begin_s, done_s, result = await _operate(OperatorPanel(config, bus), config, on_event)
    reversals = read_reversals(directory)
    due_s = _first(reversals, due=True, after_s=0.0)
    learned_now, version = result
    instants = Instants(
        friction_changes_s=change_s(plant),
        due_s=due_s,
        learning_begun_s=learning_begin_s,
        learning_done_s=done_s,
        due_cleared_s=_first(reversals, due=False, after_s=done_s),
    )
    log_lines = [line for line in printed if "learning is due" in line or f"axis {AXIS}: J " in line]
    return Drift(
        instants=instants,
        required_m=config.monitoring.required_um / UM,
        reversals=reversals,
        learned=learned_now,
        version=version,
        log_lines=log_lines,
    )


async def _operate(
    panel: OperatorPanel, config: MachineConfig, on_event: Callable[[str], None]
) -> tuple[float, float, tuple[Learned, int]]:
    """Operate the machine; return begin and end of learning (s), and functions and version in use."""
    place = list(config.axes).index(AXIS)
    mask = 1 << place
    on_event("production, compensated")
    end = await _end_of_program(panel)
    if end.due_mask & mask:
        raise PanelError("learning is due before the friction has changed")
    await _produce_until(panel, on_event, lambda due_mask: bool(due_mask & mask), "learning is due")
    on_event(f"learning is due, says the status PDO: learning axis {AXIS}, started by SDO")
    learning_begin_s = (await panel.read()).cycles * config.period_s
    await panel.execute(CommandRequest(Command.START_LEARNING, AXIS))
    ended = (LearningState.DONE, LearningState.FAILED, LearningState.ABORTED)
    end = await panel.until(lambda now: now.learning in ended, "the end of learning", LEARNING_LIMIT_S)
    status = await panel.read()
    if end.learning != LearningState.DONE:
        raise PanelError(f"learning has ended otherwise: {status.learning.reason}")
    axis = status.axes[place]
    if axis.learned is None:
        raise PanelError("learning has ended without functions")
    await _produce_until(panel, on_event, lambda due_mask: not due_mask & mask, "learning is no longer due")
    on_event("learning is no longer due")
    return learning_begin_s, status.cycles * config.period_s, (axis.learned, axis.version)


async def _end_of_program(panel: OperatorPanel) -> PanelStatus:
    return await panel.until(lambda now: now.stage == Stage.READY, "the end of the program", PROGRAM_LIMIT_S)


async def _produce_until(
    panel: OperatorPanel, on_event: Callable[[str], None], condition: Callable[[int], bool], what: str
) -> None:
    """Repeat the program until `condition` holds for the due mask at its end."""
    for number in range(1, MAX_RUNS + 1):
        on_event(f"production, run {number} until {what}")
        await panel.execute(CommandRequest(Command.START_PROGRAM))
        end = await _end_of_program(panel)
        if condition(end.due_mask):
            return
    raise PanelError(f"{what}: not after {MAX_RUNS} runs of the program")


def _first(reversals: Sequence[dict[str, Any]], *, due: bool, after_s: float) -> float:
    """Return the machine time of the first reversal with this flag after an instant. Raises RunError."""
    for entry in reversals:
        if entry["axis"] == AXIS and entry["due"] == due and entry["time_s"] > after_s:
            return float(entry["time_s"])
    raise RunError(f"the log has no reversal of {AXIS} with due = {due} after {after_s:.1f} s")


def change_s(plant: Path) -> float:
    """Read the machine time at which the friction begins to change from the plant file. Raises RunError."""
    try:
        document = tomllib.loads(plant.read_text(encoding="utf-8"))
        return float(document["axis"][AXIS]["lubrication_loss"]["start_s"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunError(f"{plant}: no axis.{AXIS}.lubrication_loss.start_s: {error!r}") from None


def drift_figures(drift: Drift) -> dict[str, Any]:
    """Return the figures for JSON: seconds of machine time, J in micrometres."""
    learned = drift.learned
    return {
        "axis": AXIS,
        "J_required_um": drift.required_m * UM,
        "J_um": {name: value_m * UM for name, value_m in drift.parts_m().items()},
        "instants": drift.instants._asdict(),
        "learning": {
            "learner": learned.learner,
            "version": drift.version,
            "strokes": learned.strokes,
            "machine_time_s": learned.machine_time_s,
            "J_before_um": learned.before_m * UM,
            "J_after_um": learned.after_m * UM,
        },
        "said": drift.log_lines,
        "reversals": [
            {
                "axis": entry["axis"],
                "time_s": entry["time_s"],
                "J_um": entry["error_mean_m"] * UM,
                "due": entry["due"],
            }
            for entry in drift.reversals
        ],
    }
