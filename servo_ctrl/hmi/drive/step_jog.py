"""Jogging: the choice of a speed or a step, and the step buttons of an axis; a press is one step."""

from collections.abc import Sequence
from functools import partial

from nicegui import ui

from servo_ctrl.commands.local_messages import AxisInfo
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.offered import offer
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import div, faint, named
from servo_ctrl.hmi.shell.units import MINUS, DisplayUnit

STEPS_M = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
"""Choices of the step; the last is the longest that the controller takes."""


class ValueChoice:
    """A row of values in the visitor's units, of which one is chosen for all axes of the page."""

    def __init__(self, values: Sequence[float], chosen: float, heading: str, mark: str, label: str) -> None:
        """`heading` names the {unit}; `label` is for screen readers."""
        self._values, self._heading, self.value = values, heading, chosen
        self._shown_unit: DisplayUnit | None = None
        self._unit = faint()
        self._choice = ui.toggle({}, on_change=self._choose).mark(mark)
        named(self._choice.props("no-caps unelevated spread"), label).classes("num")

    def refresh(self, unit: DisplayUnit) -> None:
        """Show the values in this unit."""
        if unit != self._shown_unit:
            self._shown_unit = unit
            options = {value: f"{value * unit.factor:.3g}" for value in self._values}
            self._unit.set_text(tr(self._heading, unit=unit.unit))
            self._choice.set_options(options, value=self.value)

    def _choose(self) -> None:
        if self._choice.value is not None:
            self.value = float(self._choice.value)


class StepButtons:
    """The buttons of one axis towards minus and plus; `keys` move it with Shift."""

    def __init__(self, page: OpenPage, axis: AxisInfo, keys: tuple[str, str], step: ValueChoice) -> None:
        self._page, self._axis, self._step_m = page, axis, step
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
        await self._page.ask("jog_step", axis=self._axis.name, value=direction * self._step_m.value)
