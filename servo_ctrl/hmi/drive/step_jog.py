"""Jogging by steps: the choice of the step, and the buttons of an axis. Each press is one bounded motion."""

from functools import partial

from nicegui import ui

from servo_ctrl.commands.local_messages import AxisInfo
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.offered import offer
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import div, faint, named
from servo_ctrl.hmi.shell.units import MINUS, UnitSystem

STEPS_M = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
"""Choices of the step; the last is the longest that the controller takes."""


class StepChoice:
    """The step of all axes of the page."""

    def __init__(self, page: OpenPage) -> None:
        self._page, self.step_m = page, STEPS_M[2]
        self._units: UnitSystem | None = None
        self._unit = faint()
        self._choice = ui.toggle({}, on_change=self._choose).mark("jog-step")
        named(self._choice.props("no-caps unelevated spread"), tr("Step of a jog")).classes("num")

    def refresh(self) -> None:
        """Show the steps in the visitor's units."""
        if self._page.units is not self._units:
            self._units = self._page.units
            length = self._units.length
            options = {step_m: f"{step_m * length.factor:.3g}" for step_m in STEPS_M}
            self._unit.set_text(tr("Step in {unit}: one press, one step; keys with Shift", unit=length.unit))
            self._choice.set_options(options, value=self.step_m)

    def _choose(self) -> None:
        if self._choice.value is not None:
            self.step_m = float(self._choice.value)


class StepButtons:
    """The buttons of one axis towards minus and plus; `keys` move it with Shift."""

    def __init__(self, page: OpenPage, axis: AxisInfo, keys: tuple[str, str], choice: StepChoice) -> None:
        self._page, self._axis, self._choice = page, axis, choice
        with div("bench-row").style("flex-wrap: nowrap"):
            self._buttons = [
                self._button(direction, key) for direction, key in zip((-1, 1), keys, strict=True)
            ]

    def _button(self, direction: int, key: str) -> ui.button:
        name, towards = self._axis.name, word("minus") if direction < 0 else word("plus")
        element = ui.button(
            tr("{sign} step", sign=MINUS if direction < 0 else "+"), on_click=partial(self._step, direction)
        )
        label = tr("Step axis {axis} towards {sign}", axis=name, sign=tr(towards))
        named(element.props("outline"), label).style("flex: 1 1 0")
        if key:
            element.props(f'data-step-key="{key}" aria-keyshortcuts="Shift+{key}"')
        return element.mark(f"step-{name}-{towards}")

    def refresh(self, status: MachineStatus) -> None:
        """Enable the buttons where a step would be accepted."""
        offer(self._page, self._buttons, status, "jog_step")

    async def _step(self, direction: int) -> None:
        await self._page.ask("jog_step", axis=self._axis.name, value=direction * self._choice.step_m)
