"""The learning run on the Friction page: start, pause, resume, abort, its progress and its settings."""

import math
from functools import partial
from typing import Any

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.learned_status import LEARNERS
from servo_ctrl.commands.learning_status import ACTIVE, LearningState, LearningStatus
from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.settings import Settings
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import tr, translated, word
from servo_ctrl.hmi.shell.live_content import command_buttons
from servo_ctrl.hmi.shell.offered import offer
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import Switch, button, card, choice, div, notify, pairs, progress_bar
from servo_ctrl.hmi.shell.units import UnitSystem, duration_text

BUTTONS = {
    Command.START_LEARNING: (word("Start"), "play_arrow"),
    Command.PAUSE_LEARNING: (word("Pause"), "pause"),
    Command.RESUME_LEARNING: (word("Resume"), "skip_next"),
    Command.ABORT_LEARNING: (word("Abort"), "stop"),
}
LEARNER_NAMES = {
    "fast": word("fast (pulse)"),
    "paper": word("as published (pulse)"),
    "screw": word("screw and lost motion"),
    "waveform": word("waveform"),
}
STAGES = {
    "interval": word("finding the range of accelerations"),
    "duration": word("duration of the pulse"),
    "coarse": word("amplitude, coarse"),
    "fine": word("amplitude, fine"),
    "search": word("searching the pulse"),
    "trailing": word("second trapezoid"),
    "identify": word("friction without compensation"),
    "waveform": word("force around the reversals"),
    "rest": word("force behind rests"),
    "travel": word("travelling along the screw"),
    "check": word("verifying the result"),
}
"""What a stroke is for, by the names of `learning.types.Stroke`."""
LEARNING_STATES = {
    LearningState.IDLE: word("idle"),
    LearningState.RUNNING: word("running"),
    LearningState.PAUSING: word("pausing"),
    LearningState.PAUSED: word("paused"),
    LearningState.DONE: word("done"),
    LearningState.FAILED: word("failed"),
    LearningState.ABORTED: word("aborted"),
}
REMEDY = word(
    "Repeat learning when the axis is warm, check for backlash and stick-slip, or relax the requirement."
)
FIGURES = {
    "stage": word("stage"),
    "strokes": word("strokes"),
    "remaining": word("remaining"),
    "best": word("best J"),
    "reason": word("reason"),
}


class LearningCard:
    """The card of learning."""

    def __init__(self, page: OpenPage, hello: Hello) -> None:
        self._page = page
        self._settings: Settings | None = None
        self._shown_required = ""
        names = [axis.name for axis in hello.axes]
        with card(tr("Learning"), "learning"):
            self._headline = ui.label().mark("learning-state").props("role=status aria-live=polite")
            self._headline.style("font-size: 16px; font-weight: 600")
            self._bar = progress_bar(tr("Progress of learning"), "learning-progress")
            with div("bench-pairs"):
                self._figures = pairs(translated(FIGURES), "learning-{}")
            with div("bench-row"):
                self._axis = choice(names, tr("axis"), "learning-axis", "min-width: 92px", value=names[0])
                self._learner = choice(
                    translated(LEARNER_NAMES),
                    tr("learner"),
                    "learner",
                    "min-width: 170px; flex: 1",
                    value=LEARNERS[0],
                ).on_value_change(self._set_learner)
            with div("bench-row"):
                self._buttons = command_buttons(page, BUTTONS, "flex: 1 1 40%", axis=self._axis_of)
            with div("bench-row"):
                self._required = ui.input(tr("J required")).mark("required").style("width: 150px")
                self._required.props("inputmode=decimal").on("keydown.enter", self._set_required)
                button(tr("Set"), self._set_required, "set-required")
                set_adaptation = partial(page.ask, "setting", setting="adaptation")
                self._adaptation = Switch(tr("Adaptation"), "adaptation", lambda on: set_adaptation(value=on))

    def refresh(self, status: MachineStatus) -> None:
        """Show the state of learning and its settings."""
        learning, units, self._settings = status.learning, self._page.units, status.settings
        self._headline.set_text(headline(learning, status.settings.required_m, units))
        self._bar.set_share(learning.progress)
        for key, text in learning_figures(learning, units).items():
            self._figures[key].set_text(text or "\N{EN DASH}")
        for command, element in self._buttons.items():
            offer(self._page, [element], status, command)
        self._learner.set_value(status.settings.learner)
        self._adaptation.show(status.settings.adaptation)
        required = units.error.with_unit(status.settings.required_m)
        if required != self._shown_required:  # only a change replaces what is being typed
            self._shown_required = required
            self._required.props(f'suffix="{units.error.unit}"')
            self._required.set_value(f"{status.settings.required_m * units.error.factor:.6g}")

    def _axis_of(self, command: Command) -> str:
        """Return the chosen axis for the start of a run; the other commands concern the present run."""
        return str(self._axis.value) if command is Command.START_LEARNING else ""

    async def _set_learner(self, event: ValueChangeEventArguments[Any]) -> None:
        # a refresh sets the element too: only a choice of the visitor differs from the status
        if self._settings is not None and event.value != self._settings.learner:
            await self._page.ask("setting", setting="learner", value=str(event.value))

    async def _set_required(self) -> None:
        try:
            shown = float(str(self._required.value).replace(",", "."))
        except ValueError:
            notify(tr('"{value}" is not a number.', value=self._required.value))
            return
        required_m = shown / self._page.units.error.factor
        await self._page.ask("setting", setting="required_m", value=required_m)


def headline(learning: LearningStatus, required_m: float, units: UnitSystem) -> str:
    """Return the state of the run; after its end also whether J stays above `required_m`, and what helps."""
    if not learning.axis:
        return tr("No learning run yet.")
    state = tr("Axis {axis}: {state}", axis=learning.axis, state=tr(LEARNING_STATES[learning.state]))
    if learning.state is not LearningState.DONE or not learning.best_m > required_m:
        return state
    best, required = units.error.with_unit(learning.best_m), units.error.with_unit(required_m)
    return tr(
        "{state}, requirement not reached: J {best}, required {required}. {help}",
        state=state,
        best=best,
        required=required,
        help=tr(REMEDY),
    )


def learning_figures(learning: LearningStatus, units: UnitSystem) -> dict[str, str]:
    """Return the run, or the end of the last one, as texts by the keys of FIGURES; "" without a value."""
    best = ""
    if math.isfinite(learning.best_m):
        best = units.error.with_unit(learning.best_m)
        if math.isfinite(learning.acceleration_m_s2):
            acceleration = units.acceleration.with_unit(learning.acceleration_m_s2)
            best = tr("{best} at {acceleration}", best=best, acceleration=acceleration)
    strokes = tr("{done} of {total}", done=learning.strokes_done, total=learning.strokes_total)
    return {
        "stage": tr(STAGES.get(learning.stage, learning.stage)),
        "strokes": strokes if learning.strokes_total else "",
        "remaining": duration_text(learning.remaining_s) if learning.state in ACTIVE else "",
        "best": best,
        "reason": controller_text(learning.reason),
    }
