"""The card of one axis on the Drive page: position, drive state, travel, error, velocity and jog buttons."""

import asyncio
import math

from nicegui import ui

from servo_ctrl.commands.local_messages import AxisInfo
from servo_ctrl.commands.machine_status import DriveStatus, MachineStatus
from servo_ctrl.hmi.drive.step_jog import StepButtons, ValueChoice
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.channel_names import PHASES, drive_state
from servo_ctrl.hmi.shell.live_elements import LiveLabel, LivePlace
from servo_ctrl.hmi.shell.machine_stage import Tone
from servo_ctrl.hmi.shell.offered import explain, refusal_reason
from servo_ctrl.hmi.shell.open_page import OpenPage, refusal_text
from servo_ctrl.hmi.shell.parts import CROSS, ELLIPSIS, Pill, captioned, div, faint, named, notify, panel
from servo_ctrl.hmi.shell.units import MINUS

SPEEDS_M_S = (1e-4, 1e-3, 1e-2, 5e-2)
"""Offered jog speeds, m/s; chosen. The velocity limit of the axis bounds them."""
KEYS = (("ArrowLeft", "ArrowRight"), ("ArrowDown", "ArrowUp"), ("PageDown", "PageUp"))
"""Keys towards minus and plus, of the first three axes."""
VALUES = (word("error"), word("velocity"), word("command"))
KEY_NAMES = {
    "ArrowLeft": "\N{LEFTWARDS ARROW}",
    "ArrowRight": "\N{RIGHTWARDS ARROW}",
    "ArrowDown": "\N{DOWNWARDS ARROW}",
    "ArrowUp": "\N{UPWARDS ARROW}",
    "PageDown": word("Page ↓"),
    "PageUp": word("Page ↑"),
}


class AxisMotionCard:
    """Where an axis is, how it moves, and what its drive does; with the chosen speed and step of a jog."""

    def __init__(
        self, page: OpenPage, axis: AxisInfo, number: int, speed_m_s: ValueChoice, step_m: ValueChoice
    ) -> None:
        self._page, self._axis = page, axis
        keys = KEYS[number] if number < len(KEYS) else ("", "")
        with panel(tr("Axis {axis}", axis=axis.name)).mark(f"axis-{axis.name}"):
            with div("bench-row apart"):
                with div("bench-row"):
                    ui.label(axis.name).classes("bench-axis-name")
                    self._state = Pill(f"drive-state-{axis.name}")
                    self._standard = faint().style("font-size: 11px").mark(f"drive-standard-{axis.name}")
                with div("bench-row").style("align-items: baseline; gap: 0; margin-left: auto"):
                    self._position = LiveLabel().classes("bench-figure").mark(f"position-{axis.name}")
                    self._unit = ui.label().classes("bench-unit")
            with div("bench-travel").props("aria-hidden=true"):
                self._pointer = LivePlace().classes("bench-pointer")
                ui.element("b").style(f"left: {self._travel_percent(0.0):.2f}%")
            with div("bench-row apart bench-faint num").style("font-size: 12px"):
                self._lowest, self._homed, self._highest = ui.label(), ui.label(), ui.label()
            with div("bench-axis-values num"):
                self._error, self._velocity, self._command = (
                    captioned(tr(name)).mark(f"{name}-{axis.name}") for name in VALUES
                )
            self._jog = JogButtons(page, axis, keys, speed_m_s)
            self._steps = StepButtons(page, axis, keys, step_m)

    def _travel_percent(self, position_m: float) -> float:
        lowest_m, highest_m = self._axis.travel_m
        return 100.0 * min(max((position_m - lowest_m) / (highest_m - lowest_m), 0.0), 1.0)

    def refresh(self, status: MachineStatus) -> None:
        """Show the newest row and the state of the drive."""
        units = self._page.units
        drive = next((drive for drive in status.drives if drive.axis == self._axis.name), None)
        position_m = self._newest("scale_position_m")
        if not math.isfinite(position_m):
            position_m = drive.position_m if drive else math.nan
        self._position.set_text(units.length.text(math.nan if position_unknown(drive) else position_m))
        self._unit.set_text(units.length.unit)
        if math.isfinite(position_m) and not position_unknown(drive):
            self._pointer.show(self._travel_percent(position_m))
        else:
            self._pointer.hide()
        for label, travel_m in zip((self._lowest, self._highest), self._axis.travel_m, strict=True):
            label.set_text(f"{travel_m * units.length.factor:.6g}".replace("-", MINUS))
        self._error.set_text(units.error.with_unit(self._newest("position_error_m"), sign=True))
        self._velocity.set_text(units.velocity.with_unit(self._newest("motor_velocity_m_s")))
        self._command.set_text(units.length.with_unit(self._newest("position_command_m")))
        self._state.show(*shown_drive(drive))
        self._standard.set_text(drive.state if drive and not position_unknown(drive) else "")
        self._homed.set_text(homed_text(drive))
        self._jog.refresh(status)
        self._steps.refresh(status)

    def _newest(self, channel: str) -> float:
        return self._page.link.rows.newest(f"{self._axis.name}.{channel}")


def position_unknown(drive: DriveStatus | None) -> bool:
    """Whether the position of the axis is unknown: its drive is lost, or has never sent anything."""
    return drive is None or drive.phase == "lost"


def homed_text(drive: DriveStatus | None) -> str:
    """Whether the axis is homed; a lost drive may have moved or lost its home position."""
    if drive is None or drive.phase == "lost":
        return tr("position unknown")
    return tr("homed") if drive.homed else tr("not homed")


def shown_drive(drive: DriveStatus | None) -> tuple[str, Tone]:
    """Return the state of the drive in words with a sign, and its tone."""
    if drive is None:
        return tr("… no status yet"), "calm"
    if drive.phase == "lost":
        return tr("✖ lost"), "bad"
    if drive.state.startswith("fault"):
        return f"{CROSS} {drive_state(drive.state)}", "bad"
    if drive.phase == "servo" and drive.ready:
        return f"\N{BLACK CIRCLE} {drive_state(drive.state)}", "good"
    if drive.phase == "off":
        return f"\N{WHITE CIRCLE} {drive_state(drive.state)}", "calm"
    return f"{ELLIPSIS} {tr(PHASES.get(drive.phase, drive.phase))}", "warn"


class JogButtons:
    """The buttons of one axis towards minus and plus; `speed_m_s`: the chosen speed.

    The browser renews a jog while a button or key is held; the server never does by itself.
    """

    def __init__(self, page: OpenPage, axis: AxisInfo, keys: tuple[str, str], speed_m_s: ValueChoice) -> None:
        self._page, self._axis, self._speed_m_s = page, axis, speed_m_s
        self._waiting = self._moving = self._refusal_shown = False
        self._enabled: bool | None = None
        with div("bench-row").style("flex-wrap: nowrap"):
            self._buttons = [
                self._button(direction, key) for direction, key in zip((-1, 1), keys, strict=True)
            ]
        ui.context.client.on_disconnect(self._stop)

    def _button(self, direction: int, key: str) -> ui.element:
        name, sign = self._axis.name, MINUS if direction < 0 else "+"
        towards = "minus" if direction < 0 else "plus"
        label = tr("Jog axis {axis} towards {sign}, hold", axis=name, sign=tr(towards))
        with ui.element("button").classes("bench-jog").mark(f"jog-{name}-{towards}") as button:
            named(button.props("type=button data-jog"), label)
            ui.label(f"{name.upper()}{sign}")
            if key:
                button.props(f'data-jog-key="{key}" aria-keyshortcuts="{key}"')
                with ui.element("small"):
                    ui.label(tr("hold, or key {key}", key=tr(KEY_NAMES[key])))
        button.on("jog-renew", lambda: self._renew(direction), args=[])
        button.on("jog-drop", self._stop, args=[])
        return button

    def refresh(self, status: MachineStatus) -> None:
        """Enable the buttons where a jog would be accepted."""
        refusal = refusal_reason(self._page, status, "jog")
        for button in self._buttons:
            explain(button, refusal)
        enabled = not refusal
        if enabled != self._enabled:
            self._enabled = enabled
            for button in self._buttons:
                button.props(f"aria-disabled={'false' if enabled else 'true'}")

    async def _renew(self, direction: int) -> None:
        if self._waiting:  # one renewal at a time, or they queue up where the controller answers slowly
            return
        self._waiting = self._moving = True
        velocity_m_s = direction * min(self._speed_m_s.value, self._axis.velocity_m_s)
        try:
            answer = await self._page.ask("jog", quiet=True, axis=self._axis.name, value=velocity_m_s)
        finally:
            self._waiting = False
        if (answer is None or not answer.accepted) and not self._refusal_shown:
            self._refusal_shown = True
            notify(refusal_text(answer) if answer else self._page.refusal("jog"))

    async def _stop(self) -> None:
        """End the jog; called too when the page is closed or its connection is lost."""
        self._refusal_shown = False
        if self._moving:
            self._moving = False
            link, who = self._page.link, self._page.who
            # shielded: the task of a closed page is cancelled, and the stop must be sent nevertheless
            await asyncio.shield(link.request(who, "jog", axis=self._axis.name, value=0.0))
