"""Runs learning over the bus: one axis after the other, stroke by stroke, with pause, abort and failure.

It runs in callbacks of the cycle's thread; the background worker does long work. The compensation in use
stays until a better one is stored: a trial pulse or table acts during its stroke only.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeVar

from servo_ctrl.commands.command import Command, CommandResult
from servo_ctrl.commands.learning_status import MAKING_STROKES, LearningState, LearningStatus, learning_status
from servo_ctrl.commands.objections import LEARNS, learning_already, no_such_learning
from servo_ctrl.commands.stage import Stage, refused, refused_now
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.cycle.rows import RowRouter
from servo_ctrl.daemon.learning.axis_learning import AxisLearning, LearningOutcome
from servo_ctrl.daemon.learning.collectors import Collector
from servo_ctrl.daemon.learning.learning_states import LearningEvent, following
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.units import UM

T = TypeVar("T")


class LearningJob:
    """The only learning job of a run. `learning_of(axis, learner)` makes the `AxisLearning` of an axis.

    `on_end` is called after every end of learning, successful or not.
    """

    def __init__(
        self,
        machine: MachineController,
        learning_of: Callable[[str, str], AxisLearning],
        worker: BackgroundWorker,
        rows: RowRouter,
        publisher: StatusPublisher,
        *,
        on_end: Callable[[], None],
    ) -> None:
        self.state = LearningState.IDLE
        self.outcomes: list[LearningOutcome] = []
        """Results of the last learning run."""
        self._reason = ""
        self._machine, self._learning_of, self._on_end = machine, learning_of, on_end
        self._worker, self._rows, self._publisher = worker, rows, publisher
        self._learning: AxisLearning | None = None
        self._last_learning: AxisLearning | None = None
        """The learning that `status` shows: the present one, or the last."""
        self._collector: Collector | None = None
        """The collector of the present stroke."""
        self._next_axes: list[str] = []
        """Axes to learn after the present one."""
        self._learner, self._fresh = "", False

    def status(self) -> LearningStatus:
        """Return state and progress of learning."""
        if self._last_learning is None:
            return LearningStatus(self.state, reason=self._reason)
        return learning_status(
            self.state, self._last_learning.name, self._reason, self._last_learning.outlook
        )

    def occupied(self) -> CommandResult | None:
        """Refuse other motion while learning makes strokes."""
        if self.state not in MAKING_STROKES:
            return None
        return refused(LEARNS)

    def start(self, axes: Sequence[str], learner: str, *, fresh: bool = False) -> CommandResult:
        """Learn these axes one after the other; resume interrupted runs unless `fresh`."""
        next_state = following(self.state, LearningEvent.START)
        if next_state is None:
            return refused(learning_already(self.state))
        if problem := self._not_ready():
            return problem
        self._next_axes, self._learner, self._fresh = list(axes), learner, fresh
        self.outcomes, self._reason = [], ""
        self.state = next_state
        self._next_axis()
        return CommandResult()

    def pause(self) -> CommandResult:
        """Pause after the present stroke."""
        return self._command(LearningEvent.PAUSE, Command.PAUSE_LEARNING)

    def resume(self) -> CommandResult:
        """Continue after a pause."""
        paused = self.state is LearningState.PAUSED
        if paused and (problem := self._not_ready()):
            return problem
        verdict = self._command(LearningEvent.RESUME, Command.RESUME_LEARNING)
        if verdict.accepted and paused:
            self._next_stroke()
        return verdict

    def abort(self) -> CommandResult:
        """Ramp to rest and discard the strokes of the present axis; the earlier compensation stays in use."""
        learning = self._learning
        verdict = self._command(LearningEvent.ABORT, Command.ABORT_LEARNING)
        if verdict.accepted:
            self._end_strokes("aborted")
            if learning is not None:
                self._worker.do(learning.discard, lambda _none: None, self._machine.note)
            self._on_end()
        return verdict

    def on_rest(self) -> None:
        """Evaluate a completed stroke; does nothing if the motion that ended was none."""
        learning, collected = self._learning, self._collector
        if learning is None or collected is None:
            return
        self._rows.stroke = self._collector = None
        learning.restore()
        self._do(learning, lambda: learning.take(collected), self._evaluated)

    def on_stop(self, reason: str) -> None:
        """End learning because the machine stops; the journal keeps the strokes so far."""
        if self._learning is not None:
            self._fail(self._learning, reason)

    def _next_axis(self) -> None:
        name = self._next_axes.pop(0)
        learning = self._learning_of(name, self._learner)
        self._learning = self._last_learning = learning
        self._do(learning, lambda: learning.open(fresh=self._fresh), self._opened)

    def _do(
        self, learning: AxisLearning, work: Callable[[], T], then: Callable[[AxisLearning, T], None]
    ) -> None:
        """Let the worker run `work` for an axis, then call `then`; if `work` fails, learning fails."""
        self._worker.do(work, partial(then, learning), partial(self._fail, learning))

    def _opened(self, learning: AxisLearning, notes: list[str]) -> None:
        for text in notes:
            self._machine.note(text)
        if learning is self._learning:
            self._next_stroke()

    def _evaluated(self, learning: AxisLearning, repeat_reason: str) -> None:
        if learning is not self._learning:
            return
        if repeat_reason:
            self._machine.note(repeat_reason)
        self._next_stroke()

    def _next_stroke(self) -> None:
        """Continue after a stroke with the next one, a pause, or the end."""
        learning = self._learning
        if learning is None:
            return
        if learning.stroke is None:
            self._do(learning, learning.conclude, self._learned)
            return
        self._change_state(LearningEvent.STROKE_OVER)
        if self.state is LearningState.PAUSED:
            return
        start_m = self._machine.set_points_m()
        self._do(learning, lambda: learning.prepare(start_m), self._begin)

    def _begin(self, learning: AxisLearning, reference: ProgramReference) -> None:
        if learning is not self._learning:
            return
        if self._machine.stage is not Stage.READY:
            self._fail(learning, "another motion was started meanwhile")
            return
        self._collector = learning.begin()
        self._rows.stroke = self._collector.take
        self._machine.run(reference)

    def _learned(self, learning: AxisLearning, result: Any) -> None:
        """Put the stored result into use, even if learning was ended while it was stored."""
        outcome = learning.use(result)
        self.outcomes.append(outcome)
        learned = outcome.learned
        improved = f"J {learned.before_m / UM:.2f} um -> {learned.after_m / UM:.2f} um"
        version = f"version {outcome.version} in use"
        self._machine.note(f"axis {outcome.axis}: {improved}, {learned.strokes} strokes, {version}")
        if learning is not self._learning:
            return
        if self._next_axes:
            self._next_axis()
        else:
            self._change_state(LearningEvent.LEARNED)
            self._on_end()

    def _fail(self, learning: AxisLearning, reason: str) -> None:
        if learning is not self._learning or following(self.state, LearningEvent.FAIL) is None:
            return
        self._end_strokes(reason)
        self._change_state(LearningEvent.FAIL)
        self._machine.note(f"learning axis {learning.name} has failed: {reason}")
        self._on_end()

    def _end_strokes(self, reason: str) -> None:
        """Make no further stroke: restore the earlier compensation and bring the axes to rest."""
        self._reason = reason
        learning, self._learning = self._learning, None
        if learning is not None:
            learning.restore()
        collector, self._collector = self._collector, None
        self._rows.stroke = None
        if collector is not None:
            self._machine.interrupt()

    def _command(self, event: LearningEvent, command: Command) -> CommandResult:
        if following(self.state, event) is None:
            return refused(no_such_learning(command, self.state))
        self._change_state(event)
        return CommandResult()

    def _change_state(self, event: LearningEvent) -> None:
        self.state = following(self.state, event) or self.state
        self._publisher.changed()

    def _not_ready(self) -> CommandResult | None:
        if self._machine.stage is not Stage.READY:
            return refused_now(self._machine)
        return refused(text) if (text := self._machine.at_a_switch) else None
