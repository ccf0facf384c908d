"""Executes commands that switch compensations on and off or roll learned results back."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from servo_ctrl.commands.command import Command, CommandResult, Refusal
from servo_ctrl.commands.objections import NOTHING_IN_USE
from servo_ctrl.commands.stage import refused
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.learning.learned_results import LearnedResults
from servo_ctrl.daemon.learning.pulse_compensation import AxisCompensation, Functions, tabulated
from servo_ctrl.daemon.learning.screw_compensation import ScrewCompensation
from servo_ctrl.daemon.learning.waveform_compensation import WaveformCompensation

CompensatedAxis = AxisCompensation | ScrewCompensation | WaveformCompensation

PULSE, OBSERVER, SCREW = "friction_compensation", "disturbance_observer", "screw_compensation"
WAVEFORM = "learned_waveform"
"""Sections of the machine file."""
SWITCHES = {
    Command.ENABLE_COMPENSATION: (PULSE, True),
    Command.DISABLE_COMPENSATION: (PULSE, False),
    Command.ENABLE_OBSERVER: (OBSERVER, True),
    Command.DISABLE_OBSERVER: (OBSERVER, False),
    Command.ENABLE_SCREW: (SCREW, True),
    Command.DISABLE_SCREW: (SCREW, False),
    Command.ENABLE_WAVEFORM: (WAVEFORM, True),
    Command.DISABLE_WAVEFORM: (WAVEFORM, False),
}


class CompensationCommands:
    """`commands` take an axis of the machine, "" = all. `note` logs an event."""

    def __init__(
        self,
        learned: LearnedResults,
        worker: BackgroundWorker,
        publisher: StatusPublisher,
        note: Callable[[str], None],
    ) -> None:
        self._learned = learned
        self.pulses, self.screws, self.waveforms = learned.pulses, learned.screws, learned.waveforms
        self._worker, self._publisher, self._note = worker, publisher, note
        self.axes_with = {
            PULSE: [name for name, axis in self.pulses.items() if axis.configured],
            OBSERVER: [name for name, axis in self.pulses.items() if axis.has_observer],
            SCREW: [name for name, axis in self.screws.items() if axis.configured],
            WAVEFORM: [name for name, axis in self.waveforms.items() if axis.configured],
        }
        """By section: the axes that have it."""
        self.commands: dict[Command, Callable[[str], CommandResult]] = {
            command: partial(self._switch, section, on=on) for command, (section, on) in SWITCHES.items()
        }
        self.roll_backs: dict[Command, Callable[[str], CommandResult]] = {
            command: partial(self._roll_back, NOTHING_IN_USE[command], axes, load_previous)
            for command, axes, load_previous in (
                (Command.ROLL_BACK, self.pulses, self._previous_functions),
                (Command.ROLL_BACK_SCREW, self.screws, learned.screw_store.roll_back),
                (Command.ROLL_BACK_WAVEFORM, self.waveforms, learned.waveform_store.roll_back),
            )
        }
        """Commands that must not run while an axis is learning."""

    def objection(self, names: Sequence[str], section: str) -> CommandResult | None:
        """Refuse axes without the section, or, if none is named, a machine without such an axis."""
        if not names and not self.axes_with[section]:
            return refused(f"no axis has a {section} section")
        for name in names:
            if name not in self.axes_with[section]:
                return refused(f"axis {name} has no {section} section")
        return None

    def _switch(self, section: str, name: str, *, on: bool) -> CommandResult:
        if problem := self.objection([name] if name else [], section):
            return problem
        for axis in [name] if name else self.axes_with[section]:
            if section == SCREW:
                self.screws[axis].switch(on=on)
            elif section == WAVEFORM:
                self.waveforms[axis].switch(on=on)
            elif section == PULSE:
                self.pulses[axis].switch(pulse=on)
            else:
                self.pulses[axis].switch(observer=on)
        self._publisher.changed()
        return CommandResult()

    def _previous_functions(self, axis: str) -> Functions | None:
        return tabulated(self._learned.pulse_store.roll_back(axis))

    def _roll_back(
        self,
        nothing_in_use: str,
        axes: Mapping[str, CompensatedAxis],
        load_previous: Callable[[str], Any],
        name: str,
    ) -> CommandResult:
        """Use the previous versions. A failure is logged as an event; in lockstep the result has it too."""
        problems: list[str] = []
        chosen = [axes[name]] if name else axes.values()
        affected = [axis for axis in chosen if axis.stored is not None or axis.problem]
        if not affected:
            return refused(nothing_in_use)

        def use(axis: CompensatedAxis, result: Any) -> None:
            axis.use(result)
            in_use = f"version {axis.stored.version} is in use" if axis.stored is not None else nothing_in_use
            self._note(f"axis {axis.name}: rolled back: {in_use}")
            self._publisher.changed()

        def failed(reason: str) -> None:
            self._note(reason)
            problems.append(reason)

        for axis in affected:
            self._worker.do(partial(load_previous, axis.name), partial(use, axis), failed)
        return CommandResult(Refusal.STORAGE, "; ".join(problems)) if problems else CommandResult()
