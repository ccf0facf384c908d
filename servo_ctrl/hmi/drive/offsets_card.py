"""The card of the work offsets: where the axes are in the chosen one, touching off, and clearing it."""

import math
from collections.abc import Sequence
from functools import partial

from nicegui import ui

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.local_messages import AxisInfo
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.shell.offered import offer
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import button, card, choice, confirmed, div, faint, notify
from servo_ctrl.motion.gcode.words import WORK_OFFSETS


class OffsetsCard:
    """The work offsets G54 to G59; what is touched off holds for programs that are loaded from then on."""

    def __init__(self, page: OpenPage, axes: Sequence[AxisInfo]) -> None:
        self._page, self._axes = page, [axis.name for axis in axes]
        self._shown = ""
        with card(tr("Work offset"), "offsets"):
            with div("bench-row apart"):
                self._choice = choice(
                    list(WORK_OFFSETS), tr("work offset"), "work-offset", on_change=self._choose
                ).style("min-width: 130px")
                self._value = ui.input(tr("present position is"), value="0").mark("touch-off-value")
                self._value.props("inputmode=decimal").style("flex: 1 1 90px")
                self._clear = button(tr("Clear"), self._ask_clear, "clear-offset", look="flat")
            self._places: dict[str, ui.label] = {}
            self._buttons = []
            for axis in self._axes:
                with div("bench-row apart"):
                    self._places[axis] = ui.label().classes("num").mark(f"offset-position-{axis}")
                    touch = button(
                        tr("Touch off {axis}", axis=axis.upper()),
                        partial(self._touch_off, axis),
                        f"touch-off-{axis}",
                    )
                    self._buttons.append(touch)
            faint(tr("Zeros are kept until they are set again; they move with the home of their axis."))

    def refresh(self, status: MachineStatus) -> None:
        """Show where the axes are in the chosen offset."""
        chosen, length = status.settings.work_offset, self._page.units.length
        if chosen != self._shown:
            self._shown = chosen
            self._choice.set_value(chosen)
        zeros = next((offset.zero_m for offset in status.program.offsets_m if offset.name == chosen), ())
        for axis, zero_m in zip(self._axes, zeros, strict=False):
            at_m = self._page.link.rows.newest(f"{axis}.position_command_m")
            known = math.isfinite(at_m)
            place = length.with_unit(at_m - zero_m if known else math.nan)
            self._places[axis].set_text(
                tr(
                    "{axis} {place} in {offset}, zero at {zero}",
                    axis=axis.upper(),
                    place=place,
                    offset=chosen,
                    zero=length.text(zero_m),
                )
            )
        offer(self._page, self._buttons, status, "touch_off")
        offer(self._page, [self._clear], status, Command.CLEAR_OFFSET)

    async def _choose(self) -> None:
        name = self._choice.value
        if name and name != self._shown:
            self._shown = name
            await self._page.ask("setting", setting="work_offset", value=name)

    async def _touch_off(self, axis: str) -> None:
        written = (self._value.value or "").strip().replace(",", ".")
        try:
            value_m = float(written) / self._page.units.length.factor
        except ValueError:
            notify(tr('"{written}" is not a number.', written=written))
            return
        await self._page.ask("touch_off", axis=axis, value=value_m)

    async def _ask_clear(self) -> None:
        question = tr("Clear {offset}?", offset=self._shown)
        if await confirmed(
            question, tr("Its zero is then where the axes were homed to, for all axes."), tr("Clear")
        ):
            await self._page.command(Command.CLEAR_OFFSET)
