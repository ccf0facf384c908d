"""A command handler for tests of its clients: it records requests and returns a preset answer."""

import math

from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.command import CommandRequest, CommandResult
from servo_ctrl.commands.learned_status import ScrewStatus
from servo_ctrl.commands.learning_status import LearningState, LearningStatus, learning_status
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.settings import Settings
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.part_program import PartProgram, ReadingOptions
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.learning.types import Learned, Outlook, ReversalReport

LEARNED = Learned(
    learner="fast",
    durations=((0.002, 0.150), (0.008, 0.080), (0.030, 0.045), (0.120, 0.025)),
    amplitudes=((0.002, 0.00031), (0.120, 0.0019)),
    spread_m_s2=0.004,
    trailing=((0.002, 0.040, 0.030, -0.0001),),
    before_m=9.5e-6,
    after_m=1.6e-6,
    strokes=47,
    machine_time_s=3600.4,
)
SCREW = ScrewStatus(
    enabled=True,
    version=2,
    learned_at="2026-11-21T11:00:00+00:00",
    points=((-0.1, -8e-6, 6e-6), (-0.0995, -7.5e-6, 6e-6), (0.1, 8e-6, 5.9e-6)),
    lost_motion_m=5.9e-6,
    spread_m=3e-8,
    before_m=5.04e-6,
    after_m=7e-8,
    strokes=4,
    machine_time_s=103.0,
)
OUTLOOK = Outlook(
    stage="coarse",
    strokes_done=12,
    strokes_total=48,
    remaining_s=1500.6,
    acceleration_m_s2=0.008,
    best_m=2.5e-6,
)
REVERSAL = ReversalReport(
    cycle=70_000,
    direction=-1,
    acceleration_m_s2=0.0278,
    contour_peak_m=6.3e-6,
    error_peak_m=7.2e-6,
    error_rms_m=3.1e-6,
    error_mean_m=2.4e-6,
)


class FakeCommandHandler:
    """`requests`, `changes`, `jogs`, `programs` log the calls; `verdict` is the answer, `now` the status."""

    def __init__(self, axis_names: tuple[str, ...] = ("x", "y")) -> None:
        self.requests: list[CommandRequest] = []
        self.changes: list[tuple[str, float | str | bool]] = []
        self.jogs: list[tuple[str, float]] = []
        self.programs: list[ProgramConfig] = []
        self.verdict = CommandResult()
        self.now = MachineStatus(
            stage=Stage.READY,
            cycles=0,
            missed_ticks=0,
            learning=LearningStatus(),
            axes=tuple(
                AxisStatus(
                    name=name,
                    compensation_enabled=True,
                    observer_enabled=False,
                    learning_due=False,
                    reversals=0,
                    last=None,
                    version=0,
                    learned_at="",
                    learned=None,
                )
                for name in axis_names
            ),
            settings=Settings(required_m=4e-6, learner="fast", adaptation=False),
        )

    def execute(self, request: CommandRequest) -> CommandResult:
        self.requests.append(request)
        return self.verdict

    def change(self, setting: str, value: float | str | bool) -> CommandResult:
        self.changes.append((setting, value))
        if self.verdict.accepted:
            settings = self.now.settings._replace(**{setting: value})  # type: ignore[arg-type]  # by name
            self.now = self.now._replace(settings=settings)
        return self.verdict

    def jog(self, axis: str, velocity_m_s: float) -> CommandResult:
        self.jogs.append((axis, velocity_m_s))
        return self.verdict

    def jog_step(self, axis: str, way_m: float) -> CommandResult:
        self.jogs.append((f"step {axis}", way_m))
        return self.verdict

    def touch_off(self, axis: str, value_m: float) -> CommandResult:
        self.jogs.append((f"touch off {axis}", value_m))
        return self.verdict

    def reading(self, first_line: int = 1) -> ReadingOptions:
        return ReadingOptions(first_line=first_line)

    def reading_of_line(self) -> ReadingOptions:
        return ReadingOptions(start_m=[0.0, 0.0])

    def run_line(self, program: PartProgram) -> CommandResult:
        self.programs.append(program)
        return self.verdict

    def load_program(self, program: ProgramConfig) -> CommandResult:
        self.programs.append(program)
        return self.verdict

    def status(self) -> MachineStatus:
        return self.now

    def set_learning(
        self, axis: str, state: LearningState, outlook: Outlook | None = OUTLOOK, reason: str = ""
    ) -> None:
        """Put a learning run into the status."""
        self.now = self.now._replace(learning=learning_status(state, axis, reason, outlook))

    def set_axis(self, index: int, **changed: object) -> None:
        """Replace fields of one axis' status."""
        axes = list(self.now.axes)
        axes[index] = axes[index]._replace(**changed)  # type: ignore[arg-type]  # fields by name
        self.now = self.now._replace(axes=tuple(axes))


def without_best(outlook: Outlook = OUTLOOK) -> Outlook:
    """Return the outlook before the first stroke at an acceleration."""
    return outlook._replace(best_m=math.nan)
