"""The paper's point, end to end: compensated; friction changes; learning is due; learning; compensated again.

Simulator, hub and controller are processes; we are the operator, who has SDO and the status PDO.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from servo_ctrl.axis.fault_policy import Stage
from servo_ctrl.config.desk import Command, LearningState, Request
from servo_ctrl.config.load import load_machine
from servo_ctrl.experiment.operator_panel import OperatorPanel, PanelError
from servo_ctrl.experiment.simulated_machine import running, simulated_machine
from servo_ctrl.experiment.simulated_run import RunError, new_recording
from servo_ctrl.telemetry.reversal_log import read_reversals

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.experiment.operator_panel import Status
    from servo_ctrl.learning.types import Learned

AXIS = "x"
"""Whose friction changes."""
PROGRAM_LIMIT_S, LEARNING_LIMIT_S = 200.0, 1500.0
RUNS_AT_MOST = 8
"""Runs of the program until learning is due, or due no more."""
UM = 1e6


class Instants(NamedTuple):
    """When what happened, machine time, seconds."""

    friction_changes_s: float
    due_s: float
    learning_begun_s: float
    learning_done_s: float
    due_cleared_s: float


class Drift(NamedTuple):
    """The whole story."""

    instants: Instants
    required_m: float
    reversals: list[dict[str, Any]]
    """Of the log: axis, time_s, error_mean_m (which is J), due and the other indicators."""
    learned: Learned
    version: int
    heard: list[str]
    """What the controller said about it."""

    def evaluation_m(self, begin_s: float, end_s: float) -> float:
        """Median J of the axis' reversals in a part of the run. Raises RunError when there is none."""
        found = [
            entry["error_mean_m"]
            for entry in self.reversals
            if entry["axis"] == AXIS and begin_s <= entry["time_s"] < end_s
        ]
        if not found:
            raise RunError(f"no reversal of {AXIS} between {begin_s:.1f} s and {end_s:.1f} s")
        return float(median(found))

    def parts_m(self) -> dict[str, float]:
        """J before the change, after it, and after learning, metres."""
        at = self.instants
        return {
            "compensated": self.evaluation_m(0.0, at.friction_changes_s),
            "friction changed": self.evaluation_m(at.due_s, at.learning_begun_s),
            "learned again": self.evaluation_m(at.learning_done_s, float("inf")),
        }


async def tell_story(
    machine: Path, plant: Path, program: Path, learned: Path, out: Path, say: Callable[[str], None]
) -> Drift:
    """Play it; the recording goes into a new folder of `out`, new functions into `learned`.

    Raises ServoCtrlError: a run that failed, or a story that went otherwise.
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
            begun_s, done_s, result = await _operate(OperatorPanel(config, bus), config, say)
    learned_now, version = result
    reversals = read_reversals(directory)
    due_s = _first(reversals, due=True, after_s=0.0)
    instants = Instants(
        friction_changes_s=change_s(plant),
        due_s=due_s,
        learning_begun_s=begun_s,
        learning_done_s=done_s,
        due_cleared_s=_first(reversals, due=False, after_s=done_s),
    )
    heard = [line for line in printed if "learning is due" in line or f"axis {AXIS}: J " in line]
    return Drift(instants, config.monitoring.required_um / UM, reversals, learned_now, version, heard)


async def _operate(
    panel: OperatorPanel, config: MachineConfig, say: Callable[[str], None]
) -> tuple[float, float, tuple[Learned, int]]:
    """What the operator does; machine times of begin and end of learning, and what is in use then."""
    place = list(config.axes).index(AXIS)
    mask = 1 << place
    say("production, compensated")
    end = await _end_of_program(panel)
    if end.due_mask & mask:
        raise PanelError("learning is due before the friction has changed")
    await _produce_until(panel, say, lambda due_mask: bool(due_mask & mask), "learning is due")
    say(f"learning is due, says the status PDO: learning axis {AXIS}, started by SDO")
    begun_s = (await panel.read()).cycles * config.period_s
    await panel.execute(Request(Command.START_LEARNING, AXIS))
    ended = (LearningState.DONE, LearningState.FAILED, LearningState.ABORTED)
    end = await panel.until(lambda now: now.learning in ended, "the end of learning", LEARNING_LIMIT_S)
    status = await panel.read()
    if end.learning != LearningState.DONE:
        raise PanelError(f"learning has ended otherwise: {status.learning.reason}")
    axis = status.axes[place]
    if axis.learned is None:
        raise PanelError("learning has ended without functions")
    await _produce_until(panel, say, lambda due_mask: not due_mask & mask, "learning is due no more")
    say("learning is due no more")
    return begun_s, status.cycles * config.period_s, (axis.learned, axis.version)


async def _end_of_program(panel: OperatorPanel) -> Status:
    return await panel.until(lambda now: now.stage == Stage.READY, "the end of the program", PROGRAM_LIMIT_S)


async def _produce_until(
    panel: OperatorPanel, say: Callable[[str], None], condition: Callable[[int], bool], what: str
) -> None:
    """Run the program again and again until the due bits are as they should be; a run is run to its end."""
    for number in range(1, RUNS_AT_MOST + 1):
        say(f"production, run {number} until {what}")
        await panel.execute(Request(Command.START_PROGRAM))
        end = await panel.until(
            lambda now: now.stage == Stage.READY, "the end of the program", PROGRAM_LIMIT_S
        )
        if condition(end.due_mask):
            return
    raise PanelError(f"{what}: not after {RUNS_AT_MOST} runs of the program")


def _first(reversals: Sequence[dict[str, Any]], *, due: bool, after_s: float) -> float:
    """Machine time of the axis' first reversal with this flag after an instant. Raises RunError."""
    for entry in reversals:
        if entry["axis"] == AXIS and entry["due"] == due and entry["time_s"] > after_s:
            return float(entry["time_s"])
    raise RunError(f"the log has no reversal of {AXIS} with due = {due} after {after_s:.1f} s")


def change_s(plant: Path) -> float:
    """When the plant's friction begins to change; it is the bench that knows. Raises RunError."""
    try:
        document = tomllib.loads(plant.read_text(encoding="utf-8"))
        return float(document["axis"][AXIS]["lubrication_loss"]["start_s"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunError(f"{plant}: no axis.{AXIS}.lubrication_loss.start_s: {error!r}") from None


def drift_figures(story: Drift) -> dict[str, Any]:
    """The story for JSON: seconds of machine time, J in micrometres."""
    learned = story.learned
    return {
        "axis": AXIS,
        "J_required_um": story.required_m * UM,
        "J_um": {name: value_m * UM for name, value_m in story.parts_m().items()},
        "instants": story.instants._asdict(),
        "learning": {
            "learner": learned.learner,
            "version": story.version,
            "strokes": learned.strokes,
            "machine_time_s": learned.machine_time_s,
            "J_before_um": learned.before_m * UM,
            "J_after_um": learned.after_m * UM,
        },
        "said": story.heard,
        "reversals": [
            {
                "axis": entry["axis"],
                "time_s": entry["time_s"],
                "J_um": entry["error_mean_m"] * UM,
                "due": entry["due"],
            }
            for entry in story.reversals
        ],
    }
