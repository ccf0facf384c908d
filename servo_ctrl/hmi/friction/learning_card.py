"""The learning run on the Friction page: start, pause, resume, abort, its progress and its settings."""

from functools import partial
from typing import Any

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from servo_ctrl.commands.axis_status import LEARNERS
from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.hmi.friction.learning_progress import learning_progress, possible_commands
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import Switch, button, card, div, notify, progress_bar

BUTTONS = {
    "start_learning": ("Start", "play_arrow"),
    "pause_learning": ("Pause", "pause"),
    "resume_learning": ("Resume", "skip_next"),
    "abort_learning": ("Abort", "stop"),
}
"""By command: text and icon."""
LEARNER_NAMES = {"fast": "fast (pulse)", "paper": "as the paper (pulse)", "screw": "screw and take-up"}
FIGURES = {
    "stage": "stage",
    "strokes": "strokes",
    "remaining": "remaining",
    "best": "best J",
    "reason": "reason",
}
"""Fields of `LearningProgress` and their names."""


class LearningCard:
    """The card of learning."""

    def __init__(self, page: OpenPage, hello: Hello) -> None:
        self._page = page
        self._shown_required = ""
        with card("Learning", "learning"):
            self._headline = ui.label().mark("learning-state").props("role=status aria-live=polite")
            self._headline.style("font-size: 16px; font-weight: 600")
            self._bar = progress_bar("Progress of learning", "learning-progress")
            with div("bench-pairs"):
                self._figures = {}
                for key, name in FIGURES.items():
                    ui.label(name)
                    self._figures[key] = ui.label().classes("num").mark(f"learning-{key}")
            names = [axis.name for axis in hello.axes]
            with div("bench-row"):
                self._axis = ui.select(names, value=names[0], label="axis").mark("learning-axis")
                self._axis.props("options-dense").style("min-width: 92px")
                self._learner = ui.select(LEARNER_NAMES, label="learner", value=LEARNERS[0]).mark("learner")
                self._learner.props("options-dense").style("min-width: 170px; flex: 1")
                self._learner.on_value_change(self._set_learner)
            with div("bench-row"):
                self._buttons = {
                    command: button(
                        text,
                        partial(self._command, command),
                        command.replace("_", "-"),
                        icon=icon,
                        look="unelevated" if command == "start_learning" else "outline",
                    ).style("flex: 1 1 40%")
                    for command, (text, icon) in BUTTONS.items()
                }
            with div("bench-row"):
                self._required = ui.input("J required").mark("required").style("width: 150px")
                self._required.props("inputmode=decimal").on("keydown.enter", self._set_required)
                button("Set", self._set_required, "set-required")
                self._adaptation = Switch("Adaptation", "adaptation", self._set_adaptation)

    def refresh(self) -> None:
        """Show the state of learning and its settings."""
        status, units = self._page.status, self._page.units
        if status is None:
            return
        progress = learning_progress(status.learning, units)
        self._headline.set_text(progress.headline)
        self._bar.set_value(round(progress.share, 3))
        for key, label in self._figures.items():
            label.set_text(getattr(progress, key) or "\N{EN DASH}")
        for command, possible in possible_commands(status.learning).items():
            self._buttons[command].set_enabled(possible)
        self._learner.set_value(status.settings.learner)
        self._adaptation.show(status.settings.adaptation)
        required = units.error.with_unit(status.settings.required_m)
        if required != self._shown_required:  # only a change replaces what is being typed
            self._shown_required = required
            self._required.props(f'suffix="{units.error.unit}"')
            self._required.set_value(f"{status.settings.required_m * units.error.factor:.6g}")

    async def _command(self, command: str) -> None:
        await self._page.command(command, str(self._axis.value) if command == "start_learning" else "")

    async def _set_learner(self, event: ValueChangeEventArguments[Any]) -> None:
        status = self._page.status
        # a refresh sets the element too: only a choice of the visitor differs from the status
        if status is not None and event.value != status.settings.learner:
            await self._page.ask("setting", setting="learner", value=str(event.value))

    async def _set_adaptation(self, on: bool) -> None:
        await self._page.ask("setting", setting="adaptation", value=on)

    async def _set_required(self) -> None:
        try:
            shown = float(str(self._required.value).replace(",", "."))
        except ValueError:
            notify(f'"{self._required.value}" is no number.')
            return
        required_m = shown / self._page.units.error.factor
        await self._page.ask("setting", setting="required_m", value=required_m)
