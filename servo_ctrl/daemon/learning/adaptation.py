"""Adapts the pulse functions in production: a reversal may change them slightly. Off by default.

The adapted functions stay in memory; after `CHANGES_PER_VERSION` changes and at the end of the run they are
stored as a new version.
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

CHANGES_PER_VERSION = 500
"""Changes of an axis's functions after which they are stored as a new version; chosen."""


class Adaptation:
    """The machine file sets `on`. `note` logs an event."""

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
            learning_settings(config, axis.name) if axis.configured else None for axis in self._axes
        ]
        self._busy = False
        self._changes = [0] * len(self._axes)
        """By axis: changes since the functions were stored."""
        self._adapted: list[Learned | None] = [None] * len(self._axes)
        """By axis: the functions after the last change."""

    def switch(self, *, on: bool) -> None:
        """Switch adaptation on or off; switching off stores the adapted functions."""
        self.on = on
        if not on:
            self.store()

    def take(self, index: int, report: ReversalReport, trace_m: Array) -> None:
        """Adapt to a production reversal of the axis `index`; ignore reversals during an evaluation."""
        axis, settings = self._axes[index], self._settings[index]
        learned = axis.learned
        if not self.on or self._busy or settings is None or learned is None or not axis.enabled:
            return
        result = StrokeResult(trace_m[None, :], self._config.period_s)

        def work() -> tuple[Learned, Array] | None:
            functions = adapted(learned, settings, report.acceleration_m_s2, result)
            return None if functions is None else (functions, table(functions))

        def then(functions: tuple[Learned, Array] | None) -> None:
            self._busy = False
            if functions is None or axis.learned is not learned:  # other functions came into use meanwhile
                return
            axis.adapt(*functions)
            self._adapted[index] = functions[0]
            self._changes[index] += 1
            if self._changes[index] >= CHANGES_PER_VERSION:
                self._store_axis(index)

        def failed(reason: str) -> None:
            self._busy = False
            self._note(reason)

        self._busy = True
        self._worker.do(work, then, failed)

    def store(self) -> None:
        """Store the functions adapted since the last version as a new version."""
        for index, changes in enumerate(self._changes):
            if changes:
                self._store_axis(index)

    def _store_axis(self, index: int) -> None:
        axis, changes = self._axes[index], self._changes[index]
        learned = axis.learned
        self._changes[index] = 0
        if learned is None or learned is not self._adapted[index]:
            return  # rolled back or learned again since
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
