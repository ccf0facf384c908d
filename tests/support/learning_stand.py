"""The daemon's services on a fake machine: its strokes are played back without bus or drives.

The measured position lags behind the command by `lag_m`, and by less while a pulse is enabled. Learning is a
`ShortRun` of four strokes unless a test wants the real one.
"""

from pathlib import Path
from typing import Any

import pytest

from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.machine_status import ContourStatus, MachineStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.learning import pulse_learning
from servo_ctrl.daemon.run.assemble import build_axes
from servo_ctrl.daemon.run.run_options import RunOptions
from servo_ctrl.daemon.run.services import Services
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.learning.stroke_result import evaluation_m
from servo_ctrl.learning.types import (
    NO_PULSE,
    Learned,
    LearningSettings,
    Outlook,
    Pulse,
    Stroke,
    StrokeResult,
)
from servo_ctrl.recording.channels import AxisRow

PULSE = Pulse(0.05, 0.001)
STROKES = (
    Stroke("interval", 0.7, NO_PULSE),
    Stroke("search", 0.7, PULSE),
    Stroke("check", 0.5, NO_PULSE),
    Stroke("check", 0.5, PULSE),
)


class ShortRun:
    """A learning run of four strokes; `before_m` and `after_m` are the results of the last two."""

    def __init__(self, settings: LearningSettings) -> None:
        self._settings = settings
        self._scores: list[float] = []

    @property
    def stroke(self) -> Stroke | None:
        return STROKES[len(self._scores)] if len(self._scores) < len(STROKES) else None

    def take(self, result: StrokeResult) -> None:
        self._scores.append(evaluation_m(result, self._settings.window_s))

    @property
    def outlook(self) -> Outlook:
        done = len(self._scores)
        stage = self.stroke.stage if self.stroke is not None else "done"
        return Outlook(
            stage=stage,
            strokes_done=done,
            strokes_total=len(STROKES),
            remaining_s=float(len(STROKES) - done),
            acceleration_m_s2=0.9,
            best_m=1e-6,
        )

    @property
    def learned(self) -> Learned | None:
        if self.stroke is not None:
            return None
        *_, before_m, after_m = self._scores
        points = tuple((a, PULSE.duration_s) for a in (0.5, 0.9)), ((0.5, 0.001), (0.9, 0.0012))
        return Learned("fast", *points, 0.0, (), before_m, after_m, len(STROKES), 4.0)


class FakeMachine:
    """The interface of a machine that the services use. `program` is the requested program."""

    def __init__(self, axes: int) -> None:
        self.stage = Stage.READY
        self.served = False
        self.program: ProgramReference | None = None
        self.notes: list[str] = []
        self.events: list[str] = []
        self.interrupted = 0
        self.finished = 0
        self.reason = ""
        self.missed_ticks = self.cycles = 0
        self.at_a_switch = ""
        self.setting_up = False
        self.contour = ContourStatus()
        self.at_m = [0.0] * axes

    def set_points_m(self) -> list[float]:
        return list(self.at_m)

    def run(self, program: ProgramReference) -> None:
        if self.stage is Stage.READY:
            self.program, self.stage = program, Stage.RUNNING

    def follows(self, reference: object) -> bool:
        return self.stage is Stage.RUNNING and reference is not None and self.program is reference

    def interrupt(self) -> None:
        self.interrupted += 1

    def finish(self) -> None:
        if self.stage is Stage.READY:
            self.finished += 1
            self.stage = Stage.STOPPING

    def begin(self, *, in_standby: bool) -> None:
        assert not in_standby

    def note(self, text: str) -> None:
        self.notes.append(text)

    def event(self, _event: object, text: str) -> None:
        self.events.append(text)


class LearningStand:
    """`services` of a machine file with everything they need."""

    def __init__(self, machine_file: Path, learned: Path, **options: Any) -> None:
        self.config = load_machine(machine_file)
        self.places = build_axes(self.config, plan_machine(self.config))
        self.servos = {place.servo.name: place.servo for place in self.places}
        self.motion = MotionPlan(self.config, options.pop("program", None))
        lockstep = options.pop("lockstep", True)
        usual = RunOptions(serve=True, learned_dir=learned, compensation="as configured", learn=None)
        servos = [place.servo for place in self.places]
        self.machine: Any = FakeMachine(len(self.places))
        self.services = Services(
            self.config, self.motion, self.machine, servos, usual._replace(**options), lockstep=lockstep
        )
        self.cycle = 0
        self.lag_m = 5e-6
        self.lag_with_pulse_m = 1e-6
        self.rows: list[list[float]] = []
        self.services.rows.stream = self.rows.append
        self.services.begin()

    @property
    def handler(self) -> Any:
        return self.services.handler

    @property
    def status(self) -> MachineStatus:
        return self.services.handler.status()

    def pulse(self, axis: str) -> Any:
        """The pulse parameters of the control law."""
        return self.servos[axis].params.pulse

    def play(self, samples: int | None = None, skip: int = 0) -> None:
        """Play the program, or `samples` samples of it; before the first, `skip` cycles are missed."""
        program = self.machine.program
        assert program is not None
        while samples is None or samples > 0:
            samples = None if samples is None else samples - 1
            for _ in range(skip):
                self.cycle += 1
                program.advance(self.cycle)
            skip = 0
            self.cycle += 1
            row = program.advance(self.cycle)
            if row is None:
                self.rest()
                return
            self._take(row, program.step)

    def rest(self) -> None:
        """The axes come to a standstill."""
        self.machine.stage = Stage.READY
        self.services.on_rest()

    def stop(self, reason: str) -> None:
        """Stop the machine as for a fault or a signal."""
        self.machine.stage, self.machine.reason = Stage.STOPPING, reason
        self.services.on_stop(reason)

    def _take(self, row: list[float], step: int) -> None:
        values: list[float] = [self.cycle * 1e-3, self.cycle, step]
        for index, name in enumerate(self.servos):
            position_m, velocity_m_s = row[4 * index], row[4 * index + 1]
            lag_m = self.lag_with_pulse_m if self.pulse(name).enabled else self.lag_m
            measured_m = position_m - (lag_m if velocity_m_s > 0.0 else -lag_m)
            values += AxisRow._make([0.0] * len(AxisRow._fields))._replace(
                position_command_m=position_m,
                velocity_command_m_s=velocity_m_s,
                motor_position_m=measured_m,
                scale_position_m=measured_m,
            )
            self.machine.at_m[index] = position_m
        self.services.rows.take(values)


def short_learning(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every axis learn by a `ShortRun`."""
    monkeypatch.setattr(pulse_learning, "LearningRun", ShortRun)


def learned_once(made: LearningStand, axis: str = "x") -> LearningStand:
    """The machine after this axis has learned."""
    assert made.handler.execute(CommandRequest(Command.START_LEARNING, axis)).accepted
    for _ in STROKES:
        made.play()
    assert made.status.learning.state is LearningState.DONE
    return made
