"""The learning run on the Friction page: start, pause, abort, how far it is, and its settings."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from nicegui import ui

from servo_ctrl.config.desk import LEARNERS
from servo_ctrl.hmi.bench import ask
from servo_ctrl.hmi.friction_view import possible, progress_of
from servo_ctrl.hmi.notices import tell
from servo_ctrl.hmi.parts import Switch, card

if TYPE_CHECKING:
    from nicegui.events import ValueChangeEventArguments

    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.hmi.bench import Bench, Visitor

BUTTONS = {
    "start_learning": ("Start", "play_arrow"),
    "pause_learning": ("Pause", "pause"),
    "resume_learning": ("Resume", "skip_next"),
    "abort_learning": ("Abort", "stop"),
}
"""By command: text and icon."""
LEARNER_NAMES = {"fast": "fast (pulse)", "paper": "as the paper (pulse)", "screw": "screw and take-up"}
WAYS = ("stage", "strokes", "remaining", "best", "reason")


class LearningRun:
    """The card of learning."""

    def __init__(self, bench: Bench, visitor: Visitor, hello: Hello) -> None:
        self._bench, self._visitor = bench, visitor
        self._required_shown = ""
        with card("Learning", "learning"):
            self._headline = ui.label().mark("learning-state").props("role=status aria-live=polite")
            self._headline.style("font-size: 16px; font-weight: 600")
            self._bar = ui.linear_progress(0.0, show_value=False, size="14px").mark("learning-progress")
            self._bar.props('aria-label="Progress of learning" animation-speed=200')
            with ui.element("div").classes("bench-pairs"):
                self._ways = {}
                for name in WAYS:
                    ui.label({"best": "best J"}.get(name, name))
                    self._ways[name] = ui.label().classes("num").mark(f"learning-{name}")
            names = [axis.name for axis in hello.axes]
            with ui.element("div").classes("bench-row"):
                self._axis = ui.select(names, value=names[0], label="axis").mark("learning-axis")
                self._axis.props("outlined dense options-dense").style("min-width: 92px")
                self._learner = ui.select(LEARNER_NAMES, label="learner", value=LEARNERS[0]).mark("learner")
                self._learner.props("outlined dense options-dense").style("min-width: 170px; flex: 1")
                self._learner.on_value_change(self._set_learner)
            with ui.element("div").classes("bench-row"):
                self._buttons = {
                    command: ui.button(text, icon=icon, on_click=partial(self._command, command))
                    .props("unelevated" if command == "start_learning" else "outline")
                    .mark(command.replace("_", "-"))
                    .style("flex: 1 1 40%")
                    for command, (text, icon) in BUTTONS.items()
                }
            with ui.element("div").classes("bench-row"):
                self._required = ui.input("J required").mark("required").props("outlined dense")
                self._required.props("inputmode=decimal").style("width: 150px")
                self._required.on("keydown.enter", self._set_required)
                ui.button("Set", on_click=self._set_required).props("outline").mark("set-required")
                self._adaptation = Switch("Adaptation", "adaptation", self._adapt)

    def refresh(self) -> None:
        """Show what the machine says."""
        status, units = self._bench.link.status, self._visitor.units
        if status is None:
            return
        shown = progress_of(status.learning, units)
        self._headline.set_text(shown.headline)
        self._bar.set_value(round(shown.share, 3))
        for name, label in self._ways.items():
            label.set_text(getattr(shown, name) or "\N{EN DASH}")
        for command, yes in possible(status.learning).items():
            self._buttons[command].set_enabled(yes)
        self._learner.set_value(status.settings.learner)
        self._adaptation.show(status.settings.adaptation)
        required = units.error.with_unit(status.settings.required_m)
        if required != self._required_shown:  # what is being typed stays
            self._required_shown = required
            self._required.props(f'suffix="{units.error.unit}"')
            self._required.set_value(f"{status.settings.required_m * units.error.factor:.6g}")

    async def _command(self, command: str) -> None:
        axis = str(self._axis.value) if command == "start_learning" else ""
        await ask(self._bench, self._visitor, "command", command=command, axis=axis)

    async def _set_learner(self, event: ValueChangeEventArguments[Any]) -> None:
        status = self._bench.link.status
        if status is not None and event.value != status.settings.learner:  # else it is what the machine says
            await ask(self._bench, self._visitor, "setting", setting="learner", value=str(event.value))

    async def _adapt(self, on: bool) -> None:
        await ask(self._bench, self._visitor, "setting", setting="adaptation", value=on)

    async def _set_required(self) -> None:
        try:
            shown = float(str(self._required.value).replace(",", "."))
        except ValueError:
            tell(f'"{self._required.value}" is no number.')
            return
        required_m = shown / self._visitor.units.error.factor
        await ask(self._bench, self._visitor, "setting", setting="required_m", value=required_m)
