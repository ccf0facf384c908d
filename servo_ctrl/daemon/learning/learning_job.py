"""Learning over the bus: the axes one after the other, stroke by stroke, whatever happens meanwhile.

Runs in callbacks of the cycle's thread; what takes long is done in the worker. What is in use stays until
something better is stored: a pulse or a table that is tried out acts for its stroke only.
"""

from collections.abc import Callable, Sequence
from typing import Any

from servo_ctrl.commands.command import CommandResult
from servo_ctrl.commands.learning_status import LearningState, LearningStatus, learning_status
from servo_ctrl.commands.stage import Stage, refused, refused_now
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.cycle.machine import Machine
from servo_ctrl.daemon.cycle.rows import RowRouter
from servo_ctrl.daemon.learning.axis_learning import AxisLearning, LearningOutcome
from servo_ctrl.daemon.learning.collectors import Collector
from servo_ctrl.daemon.learning.learning_states import MAKING_STROKES, LearningEvent, following
from servo_ctrl.daemon.set_points.reference import ProgramReference


class LearningJob:
    """There is one. `learning_of(axis, learner)` makes what an axis learns with.

    `on_end` is called whenever a run has ended, however it ended.
    """

    def __init__(
        self,
        learning_of: Callable[[str, str], AxisLearning],
        worker: BackgroundWorker,
        rows: RowRouter,
        publisher: StatusPublisher,
        *,
        on_end: Callable[[], None],
    ) -> None:
        self.state = LearningState.IDLE
        self.outcomes: list[LearningOutcome] = []
        """Of the last run."""
        self._reason = ""
        self._learning_of = learning_of
        self._worker, self._rows, self._publisher, self._on_end = worker, rows, publisher, on_end
        self._machine: Machine | None = None
        self._learning: AxisLearning | None = None
        self._shown: AxisLearning | None = None
        """The present one, or the last."""
        self._collector: Collector | None = None
        """Takes the samples of the stroke that is being made."""
        self._waiting: list[str] = []
        """Axes to be learned after the present one."""
        self._learner, self._fresh = "", False

    def attach(self, machine: Machine) -> None:
        """The machine is there."""
        self._machine = machine

    def status(self) -> LearningStatus:
        """How far it is."""
        if self._shown is None:
            return LearningStatus(self.state, reason=self._reason)
        return learning_status(self.state, self._shown.name, self._reason, self._shown.outlook)

    @property
    def has_the_axes(self) -> bool:
        """Strokes are being made: no other motion."""
        return self.state in MAKING_STROKES

    def start(self, axes: Sequence[str], learner: str, *, fresh: bool = False) -> CommandResult:
        """Learn these axes, one after the other; what was begun is gone on with unless `fresh`."""
        after = following(self.state, LearningEvent.START)
        if after is None:
            return refused(f"learning is {self.state.name.lower()} already; abort it first")
        if problem := self._unready():
            return problem
        self._waiting, self._learner, self._fresh = list(axes), learner, fresh
        self.outcomes, self._reason = [], ""
        self.state = after
        self._next_axis()
        return CommandResult()

    def pause(self) -> CommandResult:
        """Stop after the present stroke."""
        return self._asked(LearningEvent.PAUSE, "there is no learning to pause")

    def resume(self) -> CommandResult:
        """Go on after a pause."""
        paused = self.state is LearningState.PAUSED
        if paused and (problem := self._unready()):
            return problem
        verdict = self._asked(LearningEvent.RESUME, "there is no learning to resume")
        if verdict.accepted and paused:
            self._next_stroke()
        return verdict

    def abort(self) -> CommandResult:
        """Ramp to rest and forget the strokes of the present axis; the functions from before stay in use."""
        learning = self._learning
        verdict = self._asked(LearningEvent.ABORT, "there is no learning to abort")
        if verdict.accepted:
            self._leave("aborted")
            if learning is not None:
                self._worker.do(learning.discard, _nothing, self._note)
            self._on_end()
        return verdict

    def on_rest(self) -> None:
        """A program is over and the axes stand."""
        learning, collected = self._learning, self._collector
        if learning is None or collected is None:
            return
        self._rows.stroke = self._collector = None
        learning.restore()
        self._worker.do(
            lambda: learning.take(collected),
            lambda spoilt: self._taken(learning, spoilt),
            lambda reason: self._fail(learning, reason),
        )

    def on_stop(self, reason: str) -> None:
        """The machine stops: what was learned so far is in the journal."""
        if self._learning is not None:
            self._fail(self._learning, reason)

    def _next_axis(self) -> None:
        name = self._waiting.pop(0)
        learning = self._learning_of(name, self._learner)
        self._learning = self._shown = learning
        self._worker.do(
            lambda: learning.open(fresh=self._fresh),
            lambda said: self._opened(learning, said),
            lambda reason: self._fail(learning, reason),
        )

    def _opened(self, learning: AxisLearning, said: list[str]) -> None:
        for text in said:
            self._note(text)
        if learning is self._learning:
            self._next_stroke()

    def _taken(self, learning: AxisLearning, spoilt: str) -> None:
        if learning is not self._learning:
            return
        if spoilt:
            self._note(spoilt)
        self._next_stroke()

    def _next_stroke(self) -> None:
        """What comes after a stroke: the next one, a pause, or the end."""
        machine, learning = self._machine, self._learning
        if machine is None or learning is None:
            return
        if learning.stroke is None:
            self._worker.do(
                learning.conclude,
                lambda result: self._learned(learning, result),
                lambda reason: self._fail(learning, reason),
            )
            return
        self._become(LearningEvent.STROKE_OVER)
        if self.state is LearningState.PAUSED:
            return
        start_m = machine.set_points_m()
        self._worker.do(
            lambda: learning.prepare(start_m),
            lambda reference: self._begin(learning, reference),
            lambda reason: self._fail(learning, reason),
        )

    def _begin(self, learning: AxisLearning, reference: ProgramReference) -> None:
        machine = self._machine
        if machine is None or learning is not self._learning:
            return
        if machine.stage is not Stage.READY:
            self._fail(learning, "another motion was started meanwhile")
            return
        self._collector = learning.begin()
        self._rows.stroke = self._collector.take
        machine.run(reference)

    def _learned(self, learning: AxisLearning, result: Any) -> None:
        """A new result is stored, and used even when learning was ended in that very moment."""
        outcome = learning.use(result)
        self.outcomes.append(outcome)
        learned = outcome.learned
        improved = f"J {learned.before_m * 1e6:.2f} um -> {learned.after_m * 1e6:.2f} um"
        version = f"version {outcome.version} in use"
        self._note(f"axis {outcome.axis}: {improved}, {learned.strokes} strokes, {version}")
        if learning is not self._learning:
            return
        if self._waiting:
            self._next_axis()
        else:
            self._become(LearningEvent.LEARNED)
            self._on_end()

    def _fail(self, learning: AxisLearning, reason: str) -> None:
        if learning is not self._learning or following(self.state, LearningEvent.FAIL) is None:
            return
        self._leave(reason)
        self._become(LearningEvent.FAIL)
        self._note(f"learning axis {learning.name} has failed: {reason}")
        self._on_end()

    def _leave(self, reason: str) -> None:
        """No further stroke; what was in use before acts again, and the axes come to rest."""
        self._reason = reason
        learning, self._learning = self._learning, None
        if learning is not None:
            learning.restore()
        collector, self._collector = self._collector, None
        self._rows.stroke = None
        if collector is not None and self._machine is not None:
            self._machine.interrupt()

    def _asked(self, event: LearningEvent, otherwise: str) -> CommandResult:
        if following(self.state, event) is None:
            return refused(f"{otherwise}; learning is {self.state.name.lower()}")
        self._become(event)
        return CommandResult()

    def _become(self, event: LearningEvent) -> None:
        self.state = following(self.state, event) or self.state
        self._publisher.changed()

    def _unready(self) -> CommandResult | None:
        machine = self._machine
        if machine is None or machine.stage is not Stage.READY:
            return refused_now(machine)
        return refused(text) if (text := machine.at_a_switch) else None

    def _note(self, text: str) -> None:
        if self._machine is not None:
            self._machine.note(text)


def _nothing(_result: object) -> None:
    """There is nothing to do about it."""
