"""Learns over the bus as `servo-ctrl learn` does, and repeats strokes of the twin there: J must be equal.

As in the twin, each stroke starts at standstill just after power-up, because friction has memory.
"""

import math
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from servo_ctrl.config.learning import learning_settings
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program_model import ProgramConfig, SineStep
from servo_ctrl.daemon.run.report import Progress
from servo_ctrl.daemon.run.run_options import LearningRequest
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.hil_rig.simulated_machine import simulated_machine
from servo_ctrl.hil_rig.simulated_run import RunError, simulated_run
from servo_ctrl.learned.store import LearnedStore
from servo_ctrl.learning.schedule import RAMP_SHARE
from servo_ctrl.learning.stroke_result import evaluation_m, stroke_result
from servo_ctrl.learning.types import NO_PULSE, Learned, Pulse, Stroke
from servo_ctrl.motion.sine import speed_for_reverse_acceleration
from servo_ctrl.recording.reader import Recording
from studies.feng_2015.twin_learning import TwinLearning, TwinStroke

SAME_M = 1e-9
"""Bounds the difference of two J that count as equal; in practice they agree to the last bit."""


class RepeatedStroke(NamedTuple):
    """One stroke, and its J over Tm in the twin and over the bus, metres."""

    axis: str
    stroke: Stroke
    twin_m: float
    bus_m: float

    @property
    def same(self) -> bool:
        """Whether bus and twin agree."""
        return abs(self.bus_m - self.twin_m) < SAME_M


def drawn_strokes(twin: TwinLearning, count: int, seed: int) -> dict[str, list[TwinStroke]]:
    """Draw `count` strokes of each axis at random; return them in the order of the twin."""
    rng = np.random.default_rng(seed)
    found = {}
    for name, axis in twin.axes.items():
        places = rng.choice(len(axis.strokes), min(count, len(axis.strokes)), replace=False)
        found[name] = [axis.strokes[place] for place in sorted(places)]
    return found


async def repeat_strokes(
    machine: Path, strokes: Mapping[str, list[TwinStroke]], out: Path, on_progress: Callable[[Progress], None]
) -> list[RepeatedStroke]:
    """Repeat the strokes over the bus, one stroke of each axis in a run. Raises ServoCtrlError."""
    config = load_machine(machine)
    repeated = []
    for number in range(max(map(len, strokes.values()), default=0)):
        in_run = {axis: several[number] for axis, several in strokes.items() if number < len(several)}
        sines = [_sine(config, axis, made.stroke) for axis, made in in_run.items()]
        program = ProgramConfig.model_validate({"source": Path(f"strokes-{number + 1}"), "step": sines})
        with tempfile.TemporaryDirectory(prefix="servo-ctrl-") as folder:
            store = LearnedStore(Path(folder), config)
            for axis, made in in_run.items():
                if made.stroke.pulse != NO_PULSE:
                    store.add(axis, _always(made.stroke.pulse, made.stroke.acceleration_m_s2), {})
            run = await simulated_run(
                machine, program, out, on_progress, compensation="as configured", learned=store.directory
            )
        for axis, made in in_run.items():
            bus_m = _evaluation_m(run.recording, config, axis, made.stroke)
            repeated.append(RepeatedStroke(axis, made.stroke, made.evaluation_m, bus_m))
    return repeated


def _sine(config: MachineConfig, axis: str, stroke: Stroke) -> SineStep:
    """Return the stroke of `config.learning.stroke_steps` as a step of a program."""
    radius_mm = config.learning.radius_mm
    speed_rad_s = speed_for_reverse_acceleration(radius_mm * 1e-3, stroke.acceleration_m_s2)
    return SineStep(
        kind="sine",
        label=f"stroke of {axis}",
        axis=axis,
        amplitude_mm=radius_mm,
        reverse_acceleration_mm_s2=stroke.acceleration_m_s2 * 1e3,
        cycles=1.0,
        ramp_s=RAMP_SHARE * 2.0 * math.pi / speed_rad_s,
    )


def _always(pulse: Pulse, acceleration_m_s2: float) -> Learned:
    """Return learned functions that give this pulse at every reversal."""
    duration_s, amplitude_m_s, *trailing = pulse
    return Learned(
        learner="one stroke",
        durations=((acceleration_m_s2, duration_s),),
        amplitudes=((acceleration_m_s2, amplitude_m_s),),
        spread_m_s2=0.0,
        trailing=((acceleration_m_s2, trailing[0], trailing[1], trailing[2]),) if trailing[1] else (),
        before_m=0.0,
        after_m=0.0,
        strokes=1,
        machine_time_s=0.0,
    )


def _evaluation_m(recording: Recording, config: MachineConfig, axis: str, stroke: Stroke) -> float:
    columns = recording.segment(f"stroke of {axis}")
    settings = learning_settings(config, axis)
    measured = "scale_position_m" if config.axes[axis].scale is not None else "motor_position_m"
    try:
        result = stroke_result(
            columns[f"{axis}.position_command_m"],
            columns[f"{axis}.{measured}"],
            stroke,
            settings,
            config.period_s,
        )
    except ValueError as error:
        raise RunError(f"{recording.directory}: axis {axis}: {error}") from None
    return evaluation_m(result, settings.window_s)


class BusLearning(NamedTuple):
    """Learned functions of all axes; `store` is their directory."""

    store: Path
    axes: dict[str, Learned]
    wall_s: float
    times_real_time: float


async def learn_over_bus(machine: Path, store: Path, on_progress: Callable[[Progress], None]) -> BusLearning:
    """Learn all axes in turn, with the fast learner. Raises ServoCtrlError."""
    config = load_machine(machine)
    request = LearningRequest(learner="fast", fresh=True)
    async with simulated_machine(machine, "lockstep") as bus:
        report = await run_machine(
            config,
            None,
            bus,
            pacing="lockstep",
            record_dir=None,
            on_progress=on_progress,
            learned_dir=store,
            learn=request,
        )
    if report.failed or not report.completed:
        raise RunError(f"learning was not completed: {report.reason}")
    axes = {
        outcome.axis: outcome.learned for outcome in report.outcomes if isinstance(outcome.learned, Learned)
    }
    times_real_time = report.cycles * config.period_s / report.wall_s
    return BusLearning(store, axes, report.wall_s, times_real_time)
