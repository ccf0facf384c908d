"""Test motions over the bus: without compensation, with the observer, with the learned pulse.

Circles of R = 25 mm and the S-shaped motions are held out: learning uses sines of R = 50 mm.
"""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program_model import DwellStep, ProgramConfig, SShapeStep
from servo_ctrl.daemon.learning.learned_compensation import Compensation
from servo_ctrl.daemon.run.report import Progress
from servo_ctrl.hil_rig.simulated_run import RunError, simulated_run
from servo_ctrl.learned.store import LearnedStore
from servo_ctrl.metrology.circles import CircleResult, analyse_circles
from studies.feng_2015.s_shapes import SShapeResult, analyse_s_shapes

WITHOUT, OBSERVER, PULSE, SINGLE = "WTFC", "WDOB", "WFC", "WFC_single"
"""The paper's names; WFC_single is the pulse of the paper alone, without the second trapezoid."""
REST_S = 1.0
"""Standstill between the circles and the S-shaped motions, seconds; chosen."""


class Variant(NamedTuple):
    """One run of all motions; `learned` is the directory of the functions in use."""

    name: str
    compensation: Compensation
    learned: Path | None


class VariantResult(NamedTuple):
    """The results of one variant."""

    circles: list[CircleResult]
    shapes: list[SShapeResult]
    times_real_time: float


def variants(learned: Path, single: Path) -> list[Variant]:
    """Return the four variants: functions are in `learned`, in `single` without the second trapezoid."""
    return [
        Variant(WITHOUT, "off", None),
        Variant(OBSERVER, "observer", None),
        Variant(PULSE, "pulse", learned),
        Variant(SINGLE, "pulse", single),
    ]


def without_second_trapezoid(machine: Path, learned: Path, single: Path) -> None:
    """Copy the functions in use from `learned` to `single`, with the pulse of the paper alone."""
    config = load_machine(machine)
    source, target = LearnedStore(learned, config), LearnedStore(single, config)
    for axis in config.axes:
        stored = source.active(axis)
        if stored is not None:
            conditions = {**stored.conditions, "second trapezoid": "left out"}
            target.add(axis, stored.learned._replace(trailing=()), conditions)


def study_program(machine: Path) -> ProgramConfig:
    """Return circles, a dwell, and the S-shaped motions as one program."""
    config = load_machine(machine)
    circles, shapes = (
        load_program(machine / "programs" / name, config) for name in ("circles.toml", "s_shapes.toml")
    )
    steps = [*circles.steps, DwellStep(kind="dwell", label="rest", seconds=REST_S), *shapes.steps]
    return ProgramConfig.model_validate({"source": circles.source, "step": steps})


async def run_variant(
    machine: Path, variant: Variant, out: Path, on_progress: Callable[[Progress], None]
) -> VariantResult:
    """Run all motions. Raises ServoCtrlError, also for a motion without a whole reversal."""
    program = study_program(machine)
    run = await simulated_run(
        machine, program, out, on_progress, compensation=variant.compensation, learned=variant.learned
    )
    axis_of = {step.label: step.axis for step in program.steps if isinstance(step, SShapeStep)}
    window_s = run.machine.monitoring.window_s
    try:
        circles = analyse_circles(run.recording, window_s)
        shapes = analyse_s_shapes(run.recording, axis_of, window_s)
    except ValueError as error:
        raise RunError(f"{run.recording.directory}: {error}") from None
    return VariantResult(circles, shapes, run.report.cycles * run.machine.period_s / run.report.wall_s)
