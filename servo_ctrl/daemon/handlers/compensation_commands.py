"""Requests that switch compensations on and off, or take earlier versions into use."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from servo_ctrl.commands.command import Command, CommandResult, Refusal
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.learning.pulse_compensation import AxisCompensation, tabulated
from servo_ctrl.daemon.learning.screw_compensation import ScrewCompensation
from servo_ctrl.learned.store import LearnedStore, ScrewStore

Axis = AxisCompensation | ScrewCompensation

PULSE, OBSERVER, SCREW = "friction_compensation", "disturbance_observer", "screw_compensation"
"""Sections of the machine file."""


class CompensationCommands:
    """`commands` are carried out for an axis of the machine, "" = all. `note` takes a line for the report."""

    def __init__(
        self,
        compensation: Mapping[str, AxisCompensation],
        screws: Mapping[str, ScrewCompensation],
        *,
        store: LearnedStore,
        screw_store: ScrewStore,
        worker: BackgroundWorker,
        publisher: StatusPublisher,
        note: Callable[[str], None],
    ) -> None:
        self._compensation, self._screws = compensation, screws
        self._store, self._screw_store = store, screw_store
        self._worker, self._publisher, self._note = worker, publisher, note
        self.commands: dict[Command, Callable[[str], CommandResult]] = {
            Command.ENABLE_COMPENSATION: lambda name: self._switch_pulse(name, on=True),
            Command.DISABLE_COMPENSATION: lambda name: self._switch_pulse(name, on=False),
            Command.ENABLE_OBSERVER: lambda name: self._switch_observer(name, on=True),
            Command.DISABLE_OBSERVER: lambda name: self._switch_observer(name, on=False),
            Command.ENABLE_SCREW: lambda name: self._switch_screw(name, on=True),
            Command.DISABLE_SCREW: lambda name: self._switch_screw(name, on=False),
        }
        self.rolls_back: dict[Command, Callable[[str], CommandResult]] = {
            Command.ROLL_BACK: self._roll_back_pulse,
            Command.ROLL_BACK_SCREW: self._roll_back_screw,
        }
        """Not while an axis is learning."""

    def fitted(self, section: str) -> list[str]:
        """The axes that have this section."""
        with_pulse = {name for name, axis in self._compensation.items() if axis.has_pulse}
        with_observer = {name for name, axis in self._compensation.items() if axis.has_observer}
        with_screw = {name for name, axis in self._screws.items() if axis.fitted}
        having = {PULSE: with_pulse, OBSERVER: with_observer, SCREW: with_screw}[section]
        return [name for name in self._compensation if name in having]

    def lacking(self, names: Sequence[str], section: str) -> CommandResult | None:
        """What speaks against these axes, or all that have the section where none is named."""
        fitted = self.fitted(section)
        if not names and not fitted:
            return CommandResult(Refusal.WRONG_STATE, f"no axis has a {section} section")
        for name in names:
            if name not in fitted:
                return CommandResult(Refusal.WRONG_STATE, f"axis {name} has no {section} section")
        return None

    def _switch_pulse(self, name: str, *, on: bool) -> CommandResult:
        return self._switch(name, PULSE, lambda axis: self._compensation[axis].switch(pulse=on))

    def _switch_observer(self, name: str, *, on: bool) -> CommandResult:
        return self._switch(name, OBSERVER, lambda axis: self._compensation[axis].switch(observer=on))

    def _switch_screw(self, name: str, *, on: bool) -> CommandResult:
        return self._switch(name, SCREW, lambda axis: self._screws[axis].switch(on=on))

    def _switch(self, name: str, section: str, switch: Callable[[str], None]) -> CommandResult:
        if problem := self.lacking([name] if name else [], section):
            return problem
        for axis in [name] if name else self.fitted(section):
            switch(axis)
        self._publisher.changed()
        return CommandResult()

    def _roll_back_pulse(self, name: str) -> CommandResult:
        chosen = [self._compensation[name]] if name else list(self._compensation.values())
        none = "no learned functions are in use"
        return self._roll_back(chosen, lambda axis: tabulated(self._store.roll_back(axis)), none)

    def _roll_back_screw(self, name: str) -> CommandResult:
        chosen = [self._screws[name]] if name else list(self._screws.values())
        return self._roll_back(chosen, self._screw_store.roll_back, "no learned screw is in use")

    def _roll_back(self, chosen: Sequence[Axis], earlier: Callable[[str], Any], none: str) -> CommandResult:
        """In lockstep the verdict knows how it went; in real time what fails is an event."""
        problems: list[str] = []
        rolled = [axis for axis in chosen if axis.stored is not None or axis.problem]
        if not rolled:
            return CommandResult(Refusal.WRONG_STATE, none)
        for axis in rolled:
            self._roll_back_axis(axis, earlier, none, problems.append)
        return CommandResult(Refusal.STORAGE, "; ".join(problems)) if problems else CommandResult()

    def _roll_back_axis(
        self, axis: Axis, earlier: Callable[[str], Any], none: str, failed: Callable[[str], None]
    ) -> None:
        def then(result: Any) -> None:
            axis.use(result)
            in_use = f"version {axis.stored.version} is in use" if axis.stored is not None else none
            self._note(f"axis {axis.name}: rolled back: {in_use}")
            self._publisher.changed()

        def otherwise(reason: str) -> None:
            self._note(reason)
            failed(reason)

        self._worker.do(lambda: earlier(axis.name), then, otherwise)
