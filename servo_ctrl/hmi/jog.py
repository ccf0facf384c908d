"""Jogging from the page: the browser renews it as long as a button or key is held; nothing here does."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from nicegui import ui

from servo_ctrl.hmi.bench import ask, refusal
from servo_ctrl.hmi.notices import tell

if TYPE_CHECKING:
    from servo_ctrl.config.local_messages import AxisInfo
    from servo_ctrl.hmi.bench import Bench, Visitor

SPEEDS_M_S = (1e-4, 1e-3, 1e-2, 5e-2)
KEYS = (("ArrowLeft", "ArrowRight"), ("ArrowDown", "ArrowUp"), ("PageDown", "PageUp"))
"""Of the first three axes: towards minus and plus."""
SIGNS = {
    "ArrowLeft": "\N{LEFTWARDS ARROW}",
    "ArrowRight": "\N{RIGHTWARDS ARROW}",
    "ArrowDown": "\N{DOWNWARDS ARROW}",
    "ArrowUp": "\N{UPWARDS ARROW}",
    "PageDown": "Page \N{DOWNWARDS ARROW}",
    "PageUp": "Page \N{UPWARDS ARROW}",
}


class JogSpeed:
    """How fast; one for all axes of the page."""

    def __init__(self) -> None:
        self.value_m_s = SPEEDS_M_S[1]


class JogButtons:
    """Minus and plus of one axis."""

    def __init__(self, bench: Bench, visitor: Visitor, axis: AxisInfo, place: int, speed: JogSpeed) -> None:
        self._bench, self._visitor, self._axis, self._speed = bench, visitor, axis, speed
        self._waiting = self._moving = self._told = False
        self._shown: bool | None = None
        keys = KEYS[place] if place < len(KEYS) else ("", "")
        with ui.element("div").classes("bench-row").style("flex-wrap: nowrap"):
            self._buttons = [
                self._button(direction, key) for direction, key in zip((-1, 1), keys, strict=True)
            ]
        ui.context.client.on_disconnect(self._drop)

    def _button(self, direction: int, key: str) -> ui.element:
        name, sign = self._axis.name, "\N{MINUS SIGN}" if direction < 0 else "+"
        towards = "minus" if direction < 0 else "plus"
        with ui.element("button").classes("bench-jog").mark(f"jog-{name}-{towards}") as button:
            button.props(f'type=button data-jog aria-label="Jog axis {name} towards {towards}, hold"')
            ui.label(f"{name.upper()}{sign}")
            if key:
                button.props(f'data-jog-key="{key}" aria-keyshortcuts="{key}"')
                with ui.element("small"):
                    ui.label(f"hold, or key {SIGNS[key]}")
        button.on("jog-renew", lambda: self._renew(direction), args=[])
        button.on("jog-drop", self._drop, args=[])
        return button

    def refresh(self) -> None:
        """Buttons can be held where a jog would be accepted."""
        status = self._bench.link.status
        possible = (
            status is not None
            and self._bench.link.connected
            and status.stage == "ready"
            and not refusal(self._bench, self._visitor, "jog", {})
        )
        if possible != self._shown:
            self._shown = possible
            for button in self._buttons:
                button.props(f"aria-disabled={'false' if possible else 'true'}")

    async def _renew(self, direction: int) -> None:
        if self._waiting:  # the machine is slow to answer: one renewal at a time, or they pile up
            return
        self._waiting = self._moving = True
        velocity_m_s = direction * min(self._speed.value_m_s, self._axis.velocity_m_s)
        try:
            answer = await ask(
                self._bench, self._visitor, "jog", quiet=True, axis=self._axis.name, value=velocity_m_s
            )
        finally:
            self._waiting = False
        if (answer is None or not answer.accepted) and not self._told:
            self._told = True
            tell(answer.reason if answer else refusal(self._bench, self._visitor, "jog", {}))

    async def _drop(self) -> None:
        """Let go: also when the page is closed or its connection is lost."""
        self._told = False
        if self._moving:
            self._moving = False
            who = self._visitor.who
            await asyncio.shield(self._bench.link.request(who, "jog", axis=self._axis.name, value=0.0))
