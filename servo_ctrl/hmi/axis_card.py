"""One axis on the Drive page: its position in large figures, its drive, its travel, its jog buttons."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from nicegui import ui

from servo_ctrl.hmi.jog import JogButtons

if TYPE_CHECKING:
    from servo_ctrl.config.local_messages import AxisInfo
    from servo_ctrl.config.local_status import DriveState, Status
    from servo_ctrl.hmi.bench import Bench, Visitor
    from servo_ctrl.hmi.jog import JogSpeed

_TONES = ("calm", "good", "warn", "bad")


class AxisCard:
    """Everything of one axis."""

    def __init__(self, bench: Bench, visitor: Visitor, axis: AxisInfo, place: int, speed: JogSpeed) -> None:
        self._bench, self._visitor, self._axis = bench, visitor, axis
        name = axis.name
        with (
            ui.element("section")
            .classes("bench-card")
            .mark(f"axis-{name}")
            .props(f'aria-label="Axis {name}"')
        ):
            with ui.element("div").classes("bench-row apart"):
                with ui.element("div").classes("bench-row"):
                    ui.label(name).classes("bench-axis-name")
                    self._state = ui.label().classes("bench-pill calm").mark(f"drive-state-{name}")
                with (
                    ui.element("div")
                    .classes("bench-row")
                    .style("align-items: baseline; gap: 0; margin-left: auto")
                ):
                    self._position = ui.label().classes("bench-figure").mark(f"position-{name}")
                    self._unit = ui.label().classes("bench-unit")
            with ui.element("div").classes("bench-travel").props("aria-hidden=true"):
                self._mark = ui.element("i")
                ui.element("b").style(f"left: {self._share(0.0):.2f}%")
            with ui.element("div").classes("bench-row apart bench-faint num").style("font-size: 12px"):
                self._lowest, self._reference, self._highest = ui.label(), ui.label(), ui.label()
            with ui.element("div").classes("bench-axis-values num"):
                self._values = {
                    text: self._value(text, mark)
                    for text, mark in (("error", "error"), ("velocity", "velocity"), ("command", "command"))
                }
            self._jog = JogButtons(bench, visitor, axis, place, speed)

    def _value(self, text: str, mark: str) -> ui.label:
        with ui.element("div"):
            ui.label(text).classes("bench-faint").style("font-size: 12px")
            return ui.label().mark(f"{mark}-{self._axis.name}")

    def _share(self, position_m: float) -> float:
        """Of the travel, per cent, at least 0 and at most 100."""
        lowest_m, highest_m = self._axis.travel_m
        return 100.0 * min(max((position_m - lowest_m) / (highest_m - lowest_m), 0.0), 1.0)

    def refresh(self, status: Status) -> None:
        """Show what the machine says."""
        units, name = self._visitor.units, self._axis.name
        drive = next((one for one in status.drives if one.axis == name), None)
        position_m = self._newest("scale_position_m")
        if not math.isfinite(position_m):
            position_m = drive.position_m if drive and drive.position_m is not None else math.nan
        self._position.set_text(units.length.text(position_m))
        self._unit.set_text(units.length.unit)
        if math.isfinite(position_m):
            self._mark.style(f"left: {self._share(position_m):.2f}%")
        for label, travel_m in zip((self._lowest, self._highest), self._axis.travel_m, strict=True):
            label.set_text(f"{travel_m * units.length.factor:.6g}".replace("-", "\N{MINUS SIGN}"))
        self._values["error"].set_text(units.error.with_unit(self._newest("position_error_m"), sign=True))
        self._values["velocity"].set_text(units.velocity.with_unit(self._newest("motor_velocity_m_s")))
        self._values["command"].set_text(units.length.with_unit(self._newest("position_command_m")))
        self._show_drive(drive)
        self._jog.refresh()

    def _show_drive(self, drive: DriveState | None) -> None:
        text, tone = shown_drive(drive)
        self._state.set_text(text)
        self._state.classes(tone, remove=" ".join(set(_TONES) - {tone}))
        self._reference.set_text("homed" if drive and drive.homed else "not homed")

    def _newest(self, channel: str) -> float:
        """The last value of a channel of this axis; NaN without one."""
        rows = self._bench.link.rows
        try:
            column = rows.column(f"{self._axis.name}.{channel}", rows.end - 1)
        except KeyError:
            return math.nan
        return float(column[-1]) if len(column) else math.nan


def shown_drive(drive: DriveState | None) -> tuple[str, str]:
    """The drive's state in words with a sign, and its tone."""
    if drive is None:
        return "\N{HORIZONTAL ELLIPSIS} not heard", "calm"
    if drive.phase == "lost":
        return "\N{HEAVY MULTIPLICATION X} lost", "bad"
    if drive.state.startswith("fault"):
        return f"\N{HEAVY MULTIPLICATION X} {drive.state}", "bad"
    if drive.phase == "servo" and drive.ready:
        return f"\N{BLACK CIRCLE} {drive.state}", "good"
    if drive.phase == "off":
        return f"\N{WHITE CIRCLE} {drive.state}", "calm"
    return f"\N{HORIZONTAL ELLIPSIS} {drive.phase}, {drive.state}", "warn"
