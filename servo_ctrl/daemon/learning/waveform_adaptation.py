"""Adapts waveforms to the reversals of production, like the pulse functions. Off by default.

The adapted waveform stays in memory and is stored as a new version at the end of the run, so that a roll-back
restores the earlier waveform.
"""

from collections.abc import Callable, Mapping
from functools import partial

from kernels.arrays import Array
from servo_ctrl.config.learning import waveform_settings
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.learning.pulse_learning import conditions_of
from servo_ctrl.daemon.learning.waveform_compensation import WaveformCompensation
from servo_ctrl.learned.store import WaveformStore
from servo_ctrl.learning.reversal_waveform import LoopModel
from servo_ctrl.learning.types import ReversalReport
from servo_ctrl.learning.waveform_adaptation import AdaptationState, ProductionReversal, next_state


class WaveformAdaptation:
    """`on` returns whether adaptation is switched on; `note` logs an event."""

    def __init__(
        self,
        config: MachineConfig,
        waveforms: Mapping[str, WaveformCompensation],
        store: WaveformStore,
        worker: BackgroundWorker,
        note: Callable[[str], None],
        on: Callable[[], bool],
    ) -> None:
        self._config, self._store, self._worker, self._note, self._on = config, store, worker, note, on
        self._axes = list(waveforms.values())
        self._loops: list[LoopModel | None] = [
            waveform_settings(config, axis.name).loop if axis.learns else None for axis in self._axes
        ]
        self._states: list[AdaptationState | None] = [None] * len(self._axes)
        self._changes = [0] * len(self._axes)
        """By axis: changes since the stored version."""
        self._busy = False

    def take(self, index: int, report: ReversalReport, trace_m: Array) -> None:
        """Adapt to a production reversal of the axis `index`; ignore reversals during an evaluation."""
        axis, loop = self._axes[index], self._loops[index]
        learned = axis.learned
        if not self._on() or self._busy or loop is None or learned is None or not axis.acts:
            return
        state = self._states[index]
        if state is None or state.learned is not learned:  # learned again, or rolled back
            state, self._changes[index] = AdaptationState(learned), 0
        reversal = ProductionReversal(report.acceleration_m_s2, trace_m, report.error_mean_m)

        def then(after: AdaptationState) -> None:
            self._busy = False
            if axis.learned is not learned:  # another waveform came into use meanwhile
                return
            self._states[index] = after
            if after.learned is not learned:
                axis.adapt(after.learned)
                self._changes[index] += 1

        def failed(reason: str) -> None:
            self._busy = False
            self._note(reason)

        self._busy = True
        self._worker.do(partial(next_state, state, loop, reversal), then, failed)

    def store(self) -> None:
        """Store the adapted waveforms as new versions."""
        for index, changes in enumerate(self._changes):
            if changes:
                self._store_axis(index)

    def _store_axis(self, index: int) -> None:
        axis, changes, state = self._axes[index], self._changes[index], self._states[index]
        self._changes[index] = 0
        learned = axis.learned
        if learned is None or state is None or state.learned is not learned:
            return  # rolled back, or learned again
        conditions = {
            **conditions_of(self._config, axis.name, "adaptation"),
            "changes": changes,
            "friction_level": state.level,
        }

        def then(version: int) -> None:
            self._note(f"axis {axis.name}: waveform changed {changes} times, stored as version {version}")

        def work() -> int:
            return self._store.add(axis.name, learned, conditions).version

        self._worker.do(work, then, self._note)
