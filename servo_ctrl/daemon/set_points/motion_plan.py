"""Plans the motions of a run: its program, each time it is started, and the strokes of learning.

The program is checked offline from home, and again at each start from the present positions. Step numbers
continue over all motions, so that a recording distinguishes them.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from servo_ctrl.config.kernel_params import motion_limits
from servo_ctrl.config.learning import screw_steps, stroke_steps, waveform_objection
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.part_program import PartProgram
from servo_ctrl.config.program import check_program, check_steps
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.config.steps import program_steps
from servo_ctrl.control.compensation.learned_waveform import LearnedWaveformSettings
from servo_ctrl.control.compensation.screw_error import ScrewCompensationSettings
from servo_ctrl.control.compensation.trapezoidal_pulse import FrictionCompensationSettings
from servo_ctrl.daemon.set_points.feed_hold import FeedHold
from servo_ctrl.daemon.set_points.pace import Pace, Stops, at_raised_feed, split_paths
from servo_ctrl.daemon.set_points.reference import CHUNK_SAMPLES, ProgramReference, StepSpan
from servo_ctrl.errors import ConfigError
from servo_ctrl.learning.types import NO_PULSE, Stroke
from servo_ctrl.motion.profile import Profile
from servo_ctrl.motion.program import Step, segments

SPANS_KEPT = 5000
"""Bounds memory, because a served machine may run its program for weeks; chosen."""


class CheckedProgram(NamedTuple):
    """A program that respects the limits, its steps and its duration in cycles."""

    program: ProgramConfig
    steps: Sequence[Step]
    cycles: int


class MotionPlan:
    """A program on a machine; without one the axes hold. Raises ConfigError (limits, files)."""

    def __init__(self, machine: MachineConfig, program: ProgramConfig | None) -> None:
        self._machine = machine
        self._program = program
        self.steps: Sequence[Step] = check_program(program, machine) if program is not None else ()
        self.cycles = 0
        """Duration of the program, known once it is prepared."""
        self.current: FeedHold | None = None
        """The program that was prepared last."""
        self.stale = ""
        """Why the program must be loaded again before it runs, else ""."""
        self.runs_line = False
        """Whether `current` is a single line of G-code instead of the program of the run."""
        self.first_step = 0
        """Number of the first step of `current`."""
        self._spans_and_newest: tuple[list[StepSpan], ProgramReference | None] = [], None
        """Spans of earlier motions, and the newest motion; one tuple, because the worker replaces it."""
        self._next_step = 0
        self.pace = Pace()
        """Overrides of every program, including the present one."""
        self.single_block = self.optional_stop = False
        """Stops of the programs prepared from now on."""
        self._stops = Stops()
        """Stops of the present program."""

    @property
    def empty(self) -> bool:
        """Whether there is no program."""
        return self._program is None

    @property
    def name(self) -> str:
        """File name of the program, "" without one."""
        return self._program.source.name if self._program is not None else ""

    @property
    def entry(self) -> str:
        """The modal words in effect at the line where the program is entered; "" at its first line."""
        entry = self._program.entry if isinstance(self._program, PartProgram) else None
        return f"line {entry.line}: {entry.words}" if entry is not None else ""

    @property
    def progress(self) -> float:
        """Completed share of the last program run, 0 to 1."""
        return min(self.current.samples / max(self.cycles, 1), 1.0) if self.current is not None else 0.0

    @property
    def completed(self) -> bool:
        """Whether the last program run reached its end."""
        return self.current is not None and self.current.ended

    @property
    def spans(self) -> list[StepSpan]:
        """The executed steps, including strokes, and their cycles; about the newest `SPANS_KEPT`."""
        before, newest = self._spans_and_newest
        return before + newest.spans if newest is not None else before

    def check(self, program: ProgramConfig, start_m: Sequence[float] | None) -> CheckedProgram:
        """Check another program from `start_m`, or from home if None. Raises ConfigError."""
        steps = check_program(program, self._machine, start_m)
        cycles, _paths = check_steps(steps, program.source, self._machine, start_m)
        return CheckedProgram(program, steps, cycles)

    def replace(self, checked: CheckedProgram) -> None:
        """Replace the program, which must not be running."""
        self._program, self.steps, self.cycles = checked
        self.current, self.stale = None, ""

    def offsets_changed(self) -> None:
        """Mark a part program as stale, because it was read with other work offsets."""
        if isinstance(self._program, PartProgram):
            self.stale = "the work offsets have changed since it was read; load it again"

    def prepare(self, start_m: Sequence[float]) -> FeedHold:
        """Plan the program from `start_m`, metres by axis. Raises ConfigError beyond the limits."""
        if self._program is None:
            return self._make_feed_hold([], start_m, {}, Stops(), 1.0)
        steps, stops = self._split_at_stops(self._program, self.steps)
        return self._plan(steps, self._program, start_m, stops, is_line=False)

    def prepare_line(self, program: ProgramConfig, start_m: Sequence[float]) -> FeedHold:
        """Plan another program; that of the run stays loaded. Raises ConfigError beyond the limits."""
        steps = program_steps(program, self._machine)
        return self._plan(steps, program, start_m, Stops(), is_line=True)

    def set_single_block(self, *, single_block: bool) -> None:
        """Switch single block on or off for every program, including the present one."""
        self.single_block = self._stops.single_block = single_block

    def set_optional_stop(self, *, on: bool) -> None:
        """Switch the optional stop at M1 on or off for programs started from now on."""
        self.optional_stop = on

    def _split_at_stops(self, program: ProgramConfig, steps: Sequence[Step]) -> tuple[Sequence[Step], Stops]:
        lines = program.optional_stops if self.optional_stop and isinstance(program, PartProgram) else ()
        split, optional = split_paths(steps, lines, single_block=self.single_block)
        return split, Stops(len(split) - 1, self.single_block, optional)

    def _plan(
        self,
        steps: Sequence[Step],
        program: ProgramConfig,
        start_m: Sequence[float],
        stops: Stops,
        *,
        is_line: bool,
    ) -> FeedHold:
        """Plan the steps at the feed that the override asks for. Raises ConfigError beyond the limits."""
        raised = self.pace.raised_feed()
        slowest_m_s = float(motion_limits(self._machine).velocity_m_s.min())
        steps = at_raised_feed(steps, raised, slowest_m_s)
        self.cycles, paths = check_steps(steps, program.source, self._machine, start_m)
        self.first_step, self.runs_line = self._next_step, is_line
        return self._make_feed_hold(steps, start_m, paths, stops, raised)

    def _make_feed_hold(
        self,
        steps: Sequence[Step],
        start_m: Sequence[float],
        paths: Mapping[int, Profile],
        stops: Stops,
        raised_feed: float,
    ) -> FeedHold:
        self._stops = stops
        limits = motion_limits(self._machine).acceleration_m_s2
        reference = self._reference(steps, start_m, paths)
        self.current = FeedHold(
            reference, limits, self._machine.period_s, stops=stops, pace=self.pace, raised_feed=raised_feed
        )
        return self.current

    def prepare_stroke(self, axis: str, stroke: Stroke, start_m: Sequence[float]) -> ProgramReference:
        """Plan a learning stroke, which `strokes_beyond_limits` has checked except the move to its start."""
        steps = stroke_steps(self._machine, axis, stroke, start_m)
        if len(steps) > 1:
            check_steps(steps, self._machine.source, self._machine, start_m)
        return self._reference(steps, start_m)

    def prepare_travel(self, axis: str, start_m: Sequence[float]) -> ProgramReference:
        """Plan a travel that learns the screw. Raises ConfigError when it leaves the limits."""
        steps = screw_steps(self._machine, axis, start_m)
        check_steps(steps, self._machine.source, self._machine, start_m)
        return self._reference(steps, start_m)

    def strokes_beyond_limits(self, learned: type[Any] = FrictionCompensationSettings) -> dict[str, str]:
        """Return the axes with this section whose learning strokes would leave the limits, and why."""
        reasons = {}
        for name, axis in self._machine.axes.items():
            if axis.section(learned) is None:
                continue
            if learned is LearnedWaveformSettings and (reason := waveform_objection(axis)):
                reasons[name] = str(
                    ConfigError(self._machine.source, f"axis.{name}.learned_waveform", reason)
                )
                continue
            for acceleration_mm_s2 in self._machine.learning.accelerations_mm_s2:
                stroke = Stroke("learning", acceleration_mm_s2 * 1e-3, NO_PULSE)
                if reason := self._objection(partial(stroke_steps, self._machine, name, stroke)):
                    text = f"the stroke at {acceleration_mm_s2:g} mm/s^2 is not possible: {reason}"
                    reasons[name] = str(ConfigError(self._machine.source, "learning", text))
                    break
        return reasons

    def travels_beyond_limits(self) -> dict[str, str]:
        """Return the axes whose screw-learning travels are impossible, and why."""
        reasons = {}
        for name, axis in self._machine.axes.items():
            if axis.section(ScrewCompensationSettings) is None:
                continue
            if reason := self._objection(partial(screw_steps, self._machine, name)):
                text, key = f"no travel is possible: {reason}", f"axis.{name}.screw_compensation"
                reasons[name] = str(ConfigError(self._machine.source, key, text))
        return reasons

    def _objection(self, steps_from: Callable[[Sequence[float]], Sequence[Step]]) -> str:
        """Return why the steps from mid-travel of all axes leave the limits, else ""."""
        middle_m = [sum(axis.limits.position_mm) * 0.5e-3 for axis in self._machine.axes.values()]
        try:
            check_steps(steps_from(middle_m), self._machine.source, self._machine, middle_m)
        except ConfigError as error:
            return error.reason
        return ""

    def _reference(
        self, steps: Sequence[Step], start_m: Sequence[float], paths: Mapping[int, Profile] | None = None
    ) -> ProgramReference:
        start, limits = np.asarray(start_m, dtype=np.float64), motion_limits(self._machine)
        first = self._next_step
        self._next_step += len(steps)
        motion = segments(
            steps, start, limits, self._machine.period_s, segment_samples=CHUNK_SAMPLES, planned=paths or {}
        )
        reference = ProgramReference(motion, first_step=first)
        self._spans_and_newest = (
            self.spans[-SPANS_KEPT:],
            reference,
        )  # one motion at a time: the previous one is over
        return reference
