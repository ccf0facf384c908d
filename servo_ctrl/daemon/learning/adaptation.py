"""Learning that goes on in production: a reversal may change the functions in use a little. Off by default.

The adapted functions are kept in memory, and stored as a new version now and then and when the run ends.
"""

from collections.abc import Callable, Mapping

from kernels.arrays import Array
from servo_ctrl.config.learning import learning_settings
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.learning.pulse_compensation import AxisCompensation, Functions
from servo_ctrl.daemon.learning.pulse_learning import conditions_of
from servo_ctrl.learned.store import LearnedStore
from servo_ctrl.learning.adaptation import adapted
from servo_ctrl.learning.pulse_functions import table
from servo_ctrl.learning.types import Learned, ReversalReport, StrokeResult

STORED_EVERY = 500
"""Changes of an axis' functions after which they become a version of their own; chosen."""


class Adaptation:
    """`on` from the machine file. `note` takes what is worth a line in the report."""

    def __init__(
        self,
        config: MachineConfig,
        compensation: Mapping[str, AxisCompensation],
        store: LearnedStore,
        worker: BackgroundWorker,
        note: Callable[[str], None],
    ) -> None:
        self.on = config.learning.adaptation
        self._config, self._store, self._worker, self._note = config, store, worker, note
        self._axes = list(compensation.values())
        self._settings = [
            learning_settings(config, axis.name) if axis.has_pulse else None for axis in self._axes
        ]
        self._busy = False
        self._changes = [0] * len(self._axes)
        """Since they were stored."""
        self._adapted: list[Learned | None] = [None] * len(self._axes)
        """The functions after the last change."""

    def switch(self, *, on: bool) -> None:
        """Adapt from now on, or stop; what was adapted so far is stored."""
        self.on = on
        if not on:
            self.store()

    def take(self, index: int, report: ReversalReport, trace_m: Array) -> None:
        """Take a reversal of production, of the axis with this index. While one is evaluated, others pass."""
        axis, settings = self._axes[index], self._settings[index]
        learned = axis.learned
        if not self.on or self._busy or settings is None or learned is None or not axis.enabled:
            return
        result = StrokeResult(trace_m[None, :], self._config.period_s)

        def work() -> tuple[Learned, Array] | None:
            better = adapted(learned, settings, report.acceleration_m_s2, result)
            return None if better is None else (better, table(better))

        def then(better: tuple[Learned, Array] | None) -> None:
            self._busy = False
            if better is None or axis.learned is not learned:  # other functions came meanwhile
                return
            axis.adapt(*better)
            self._adapted[index] = better[0]
            self._changes[index] += 1
            if self._changes[index] >= STORED_EVERY:
                self._store_axis(index)

        def failed(reason: str) -> None:
            self._busy = False
            self._note(reason)

        self._busy = True
        self._worker.do(work, then, failed)

    def store(self) -> None:
        """Store what was adapted since the last version as a new one."""
        for index, changes in enumerate(self._changes):
            if changes:
                self._store_axis(index)

    def _store_axis(self, index: int) -> None:
        axis, changes = self._axes[index], self._changes[index]
        learned = axis.learned
        self._changes[index] = 0
        if learned is None or learned is not self._adapted[index]:
            return  # rolled back, or learned anew
        conditions = {**conditions_of(self._config, axis.name, "adaptation"), "changes": changes}

        def then(functions: Functions) -> None:
            if axis.learned is learned:
                axis.use(functions)
            version = functions.stored.version
            self._note(f"axis {axis.name}: adapted by {changes} reversals, stored as version {version}")

        self._worker.do(
            lambda: Functions(self._store.add(axis.name, learned, conditions), table(learned)),
            then,
            self._note,
        )
