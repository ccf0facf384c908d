"""Jog buttons: the browser renews a jog while a button or key is held; the server never does by itself."""

import asyncio
from collections.abc import Callable

from nicegui import ui

from servo_ctrl.commands.local_messages import AxisInfo
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import div, notify
from servo_ctrl.hmi.shell.units import MINUS

SPEEDS_M_S = (1e-4, 1e-3, 1e-2, 5e-2)
"""Choices of the jog speed; an axis goes no faster than its own limit."""
KEYS = (("ArrowLeft", "ArrowRight"), ("ArrowDown", "ArrowUp"), ("PageDown", "PageUp"))
"""Keys towards minus and plus, of the first three axes."""
KEY_NAMES = {
    "ArrowLeft": "\N{LEFTWARDS ARROW}",
    "ArrowRight": "\N{RIGHTWARDS ARROW}",
    "ArrowDown": "\N{DOWNWARDS ARROW}",
    "ArrowUp": "\N{UPWARDS ARROW}",
    "PageDown": "Page \N{DOWNWARDS ARROW}",
    "PageUp": "Page \N{UPWARDS ARROW}",
}


class JogButtons:
    """The buttons of one axis towards minus and plus; `speed_m_s` returns the chosen speed."""

    def __init__(self, page: OpenPage, axis: AxisInfo, number: int, speed_m_s: Callable[[], float]) -> None:
        self._page, self._axis, self._speed_m_s = page, axis, speed_m_s
        self._waiting = self._moving = self._refusal_shown = False
        self._enabled: bool | None = None
        keys = KEYS[number] if number < len(KEYS) else ("", "")
        with div("bench-row").style("flex-wrap: nowrap"):
            self._buttons = [
                self._button(direction, key) for direction, key in zip((-1, 1), keys, strict=True)
            ]
        ui.context.client.on_disconnect(self._stop)

    def _button(self, direction: int, key: str) -> ui.element:
        name, sign = self._axis.name, MINUS if direction < 0 else "+"
        towards = "minus" if direction < 0 else "plus"
        with ui.element("button").classes("bench-jog").mark(f"jog-{name}-{towards}") as button:
            button.props(f'type=button data-jog aria-label="Jog axis {name} towards {towards}, hold"')
            ui.label(f"{name.upper()}{sign}")
            if key:
                button.props(f'data-jog-key="{key}" aria-keyshortcuts="{key}"')
                with ui.element("small"):
                    ui.label(f"hold, or key {KEY_NAMES[key]}")
        button.on("jog-renew", lambda: self._renew(direction), args=[])
        button.on("jog-drop", self._stop, args=[])
        return button

    def refresh(self, status: MachineStatus) -> None:
        """Enable the buttons where a jog would be accepted."""
        ready = self._page.link.connected and status.stage is Stage.READY
        enabled = ready and not self._page.refusal("jog")
        if enabled != self._enabled:
            self._enabled = enabled
            for button in self._buttons:
                button.props(f"aria-disabled={'false' if enabled else 'true'}")

    async def _renew(self, direction: int) -> None:
        if self._waiting:  # one renewal at a time, or they queue up where the controller answers slowly
            return
        self._waiting = self._moving = True
        velocity_m_s = direction * min(self._speed_m_s(), self._axis.velocity_m_s)
        try:
            answer = await self._page.ask("jog", quiet=True, axis=self._axis.name, value=velocity_m_s)
        finally:
            self._waiting = False
        if (answer is None or not answer.accepted) and not self._refusal_shown:
            self._refusal_shown = True
            notify(answer.reason if answer else self._page.refusal("jog"))

    async def _stop(self) -> None:
        """End the jog; called too when the page is closed or its connection is lost."""
        self._refusal_shown = False
        if self._moving:
            self._moving = False
            link, who = self._page.link, self._page.who
            # shielded: the task of a closed page is cancelled, and the stop must be sent nevertheless
            await asyncio.shield(link.request(who, "jog", axis=self._axis.name, value=0.0))
