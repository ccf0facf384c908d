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
from servo_ctrl.learning.level_over_temperature import relative_to
from servo_ctrl.learning.reversal_waveform import LoopModel, WaveformLearned
from servo_ctrl.learning.temperature_input import TemperatureInput
from servo_ctrl.learning.types import ReversalReport
from servo_ctrl.learning.waveform_adaptation import (
    AdaptationState,
    ProductionReversal,
    at_temperature,
    next_state,
)


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
        state = self._state(index, learned)
        reversal = ProductionReversal(
            report.acceleration_m_s2, trace_m, report.error_mean_m, axis.temperature.degc
        )

        self._evaluate(index, learned, partial(next_state, state, loop, reversal))

    def warmed(self, name: str, temperature: TemperatureInput, elapsed_s: float) -> None:
        """Let the level of an axis follow its temperature; it stands still during an evaluation."""
        index = next(place for place, axis in enumerate(self._axes) if axis.name == name)
        axis, loop = self._axes[index], self._loops[index]
        axis.temperature, learned = temperature, axis.learned
        if not self._on() or self._busy or loop is None or learned is None or not axis.acts:
            return
        state = self._state(index, learned)
        if state.schedule.acts:
            work = partial(at_temperature, state, loop, temperature.degc, elapsed_s)
            self._evaluate(index, learned, work)

    def _evaluate(self, index: int, learned: WaveformLearned, work: Callable[[], AdaptationState]) -> None:
        """Have the worker compute the next state of an axis whose waveform in use is `learned`."""

        def then(after: AdaptationState) -> None:
            self._busy = False
            if self._axes[index].learned is learned:  # else another waveform came into use meanwhile
                self._take_over(index, after)

        def failed(reason: str) -> None:
            self._busy = False
            self._note(reason)

        self._busy = True
        self._worker.do(work, then, failed)

    def _state(self, index: int, learned: WaveformLearned) -> AdaptationState:
        """Return the state of an axis; a new one if the waveform was learned again or rolled back."""
        state = self._states[index]
        if state is None or state.learned is not learned:
            state, self._changes[index] = AdaptationState(learned, schedule=learned.schedule), 0
            self._states[index] = state
        return state

    def _take_over(self, index: int, after: AdaptationState) -> None:
        """Make this the state of an axis, and its waveform that in use."""
        axis = self._axes[index]
        self._states[index] = after
        if after.learned is not axis.learned:
            axis.adapt(after.learned)
            self._changes[index] += 1

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

        scheduled = learned._replace(schedule=relative_to(state.schedule, state.level))

        def work() -> int:
            return self._store.add(axis.name, scheduled, conditions).version

        self._worker.do(work, then, self._note)
