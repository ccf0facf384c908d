"""Plan of the positioning study: motions of the stages of Wang et al. 2014, and the times of the readings.

One cycle is the linear cycle of ISO 230-2: up through the targets, a turn beyond the last one, down through
them, and a turn at the start. A reading is taken READ_S after the command has arrived. Then the axis rests
for a random time, since the reader of a gauge is not synchronous with the machine.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.control.compensation.sampled_dual_loop import SampledDualLoopSettings
from servo_ctrl.control.compensation.screw_error import ScrewCompensationSettings
from servo_ctrl.errors import ServoCtrlError
from studies.wang_2014.stages import TARGETS, Stage

AXIS = "x"
UP, DOWN = 0, 1
"""Direction of the cycle at a reading: towards the last target, and back."""
DIRECTION_NAMES = ("up", "down")
READ_S = 1.0
"""Time from the arrival of the command to the reading; chosen."""
LONGEST_WAIT_S = 0.1
"""Bounds the random dwell after a reading; chosen."""
STEP_MM = 5.0
"""Distance of the targets; chosen."""
OVERRUN_MM = 2.5
"""Distance from the last target to the turning point; chosen."""
FEED_MM_MIN = 3000.0
"""Chosen."""
SEED = 2014
"""Seed of the random dwells and the uneven targets; chosen."""


class Series(NamedTuple):
    """Targets of repeated cycles, millimetres."""

    name: str
    targets_mm: tuple[float, ...]
    most_runs: int = 1000

    @property
    def turn_mm(self) -> float:
        """Turning point of the axis beyond the last target."""
        return self.targets_mm[-1] + OVERRUN_MM


AT_100MM = Series("at_100mm", (100.0,))
OVER_TRAVEL = Series("over_travel", tuple(STEP_MM * place for place in range(1, TARGETS + 1)))


def irregular(rng: np.random.Generator, most_runs: int = 5) -> Series:
    """Return the series of ISO 230-2: five runs there, uneven targets.

    On the even grid every target is a whole turn of the screw, and its wobble does not show.
    """
    shifts = rng.uniform(0.0, 4.0, TARGETS).tolist()
    targets = zip(OVER_TRAVEL.targets_mm, shifts, strict=True)
    return Series("irregular", tuple(round(place - shift, 3) for place, shift in targets), most_runs)


IRREGULAR = irregular(np.random.default_rng(SEED))
SERIES = {series.name: series for series in (AT_100MM, OVER_TRAVEL, IRREGULAR)}


class Visit(NamedTuple):
    """One reading at a target, in the order of the program."""

    run: int
    target: int
    """Index in the targets of the series."""
    direction: int


class Plan(NamedTuple):
    """A program, and the reading at the end of each of its reading steps."""

    program: ProgramConfig
    visits: dict[int, Visit]


def stage_machine(directory: Path, stage: Stage) -> MachineConfig:
    """Return the machine with the compensations of the stage. Raises ConfigError, ServoCtrlError."""
    if stage.continuous:
        return load_machine(directory / "controller_continuous.toml")
    machine = load_machine(directory)
    if AXIS not in machine.axes:
        raise ServoCtrlError(f"{machine.source}: there is no axis {AXIS}; the study positions it")
    axis = machine.axes[AXIS]
    sampled, screw = axis.section(SampledDualLoopSettings), axis.section(ScrewCompensationSettings)
    if sampled is None or screw is None:
        raise ServoCtrlError(
            f"{machine.source}: axis.{AXIS}: sampled_dual_loop and screw_compensation are compared; "
            "both sections must be there"
        )
    sampled = replace(
        sampled,
        enabled=stage.sampled,
        profile="s_curve" if stage.smooth else "trapezoidal",
        gain=stage.gain,
        corrections=stage.corrections,
    )
    screw = replace(screw, enabled=stage.screw)
    axis = axis.model_copy(update={"sampled_dual_loop": sampled, "screw_compensation": screw})
    return machine.model_copy(update={"axes": {**machine.axes, AXIS: axis}})


def plan_series(machine: MachineConfig, stage: Stage, series: Series, runs: int, seed: int = SEED) -> Plan:
    """Return the program of `runs` cycles of the series, starting at zero."""
    rng = np.random.default_rng(seed)
    longest = round(LONGEST_WAIT_S / machine.period_s)
    acceleration_mm_s2 = machine.axes[AXIS].limits.acceleration_mm_s2

    def move(to_mm: float) -> dict[str, Any]:
        return {
            "kind": "move",
            "label": f"to {to_mm:g} mm",
            "to_mm": {AXIS: to_mm},
            "feed_mm_min": FEED_MM_MIN,
            "profile": "s_curve" if stage.smooth else "trapezoidal",
            "acceleration_mm_s2": acceleration_mm_s2,
        }

    steps: list[dict[str, Any]] = []
    visits: dict[int, Visit] = {}
    for run in range(runs):
        for to_mm, target, direction in _cycle(series, stage):
            steps += [move(to_mm), {"kind": "dwell", "label": "rest", "seconds": READ_S}]
            if target is not None:
                label = f"read {to_mm:g} mm {DIRECTION_NAMES[direction]}, run {run + 1}"
                steps[-1]["label"] = label
                visits[len(steps) - 1] = Visit(run, target, direction)
            wait_s = int(rng.integers(1, longest, endpoint=True)) * machine.period_s
            steps.append({"kind": "dwell", "label": "wait", "seconds": wait_s})
    source = Path(f"{series.name}-{stage.name}")
    return Plan(ProgramConfig.model_validate({"source": source, "step": steps}), visits)


def _cycle(series: Series, stage: Stage) -> Iterator[tuple[float, int | None, int]]:
    """Yield position mm, target index (None at a turn) and direction of one cycle."""
    for target, place_mm in enumerate(series.targets_mm):
        yield place_mm, target, UP
    yield series.turn_mm, None, DOWN
    for target, place_mm in reversed(list(enumerate(series.targets_mm))):
        if stage.one_sided:
            yield place_mm - STEP_MM, None, DOWN  # all approaches have the same length
        yield place_mm, target, DOWN
    yield 0.0, None, UP
