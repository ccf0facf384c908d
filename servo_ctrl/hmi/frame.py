"""What every page has around its content: links, the machine's stage, who has control, units, and STOP.

The page has no Tailwind: for the layout there are Quasar's classes and the `bench-` ones of static/bench.css.
"""

from __future__ import annotations

import itertools
import time
from typing import TYPE_CHECKING

from nicegui import ui

from servo_ctrl.hmi.access import Role
from servo_ctrl.hmi.bench import ask, role_of
from servo_ctrl.hmi.guard import LOGIN
from servo_ctrl.hmi.notices import tell
from servo_ctrl.hmi.parts import confirmed
from servo_ctrl.hmi.preferences import DARK_COOKIE, UNITS_COOKIE, remember
from servo_ctrl.hmi.stages import shown_stage
from servo_ctrl.hmi.units import SYSTEMS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from servo_ctrl.hmi.bench import Bench, Visitor

REFRESH_S = 0.2
LEAVES_S = 1.0
"""So long a browser has to go to the login page; then its page is taken away."""
_LOG_OUT = "() => fetch('/logout', {method: 'POST'}).then(() => location.assign('/login'))"
_STOP = (
    '<button type="button" id="bench-stop" data-testid="stop" aria-label="Stop the machine; key Escape">'
    "STOP<small>or key Esc</small></button>"
)
_STOP_FAILED = '<div id="bench-stop-failed" role="alert" hidden></div>'
_STALE = (
    '<div class="bench-banner" id="bench-stale-banner" role="alert">The page is not connected. '
    "What it shows is old. Use the emergency stop if you have to.</div>"
)
TAKE_OVER = "What the machine is doing goes on. They are told."
PILLS = "calm good warn bad"
"""Classes of a pill, one of which it has."""


def build_page(
    bench: Bench,
    visitor: Visitor,
    path: str,
    titles: Mapping[str, str],
    build: Callable[[Bench, Visitor], None],
) -> None:
    """The frame with a page's content in it; `titles` are those of all pages by their address."""
    frame = Frame(bench, visitor, path, titles)
    with ui.element("main").classes("bench-content").mark("content"):
        build(bench, visitor)
    ui.timer(REFRESH_S, frame.refresh)


class Frame:
    """Head and foot of one open page."""

    def __init__(self, bench: Bench, visitor: Visitor, path: str, titles: Mapping[str, str]) -> None:
        self._bench = bench
        self._visitor = visitor
        self._client, self._left = ui.context.client, False
        self._beats, self._linked = itertools.cycle(range(1000)), True
        self._seen = bench.control.last.number
        self._dark = ui.dark_mode(visitor.dark)
        with ui.header(bordered=False).classes("bench-head"):
            self._head(path, titles)
        with ui.footer(bordered=False).classes("bench-foot"):
            self._event = ui.label().mark("last-event")
            self._count = ui.label().classes("num bench-optional").mark("cycle-count")
            self._beat = ui.element("span").props("id=bench-beat data-beat=0").style("display: none")
        self.refresh()

    def _head(self, path: str, titles: Mapping[str, str]) -> None:
        with ui.element("div").classes("bench-row bench-who").style("flex-wrap: nowrap; min-width: 0"):
            self._machine = ui.label().classes("bench-machine").mark("machine")
            self._stage = (
                ui.label().classes("bench-pill calm").mark("stage").props("role=status aria-live=polite")
            )
        with ui.element("nav").classes("bench-nav").props('aria-label="Pages"'):
            for address, title in titles.items():
                link = ui.link(title, address).mark(f"link-{title.lower()}")
                if address == path:
                    link.props("aria-current=page")
        with ui.element("div").classes("bench-tools bench-control"):
            self._holder = ui.label().classes("bench-faint").mark("control-holder")
            self._take = ui.button("Take control", on_click=self._take_control).mark("take-control")
            self._take.props("unelevated")
        with ui.element("div").classes("bench-tools bench-looks"):
            self._units = ui.select(
                {name: units.label for name, units in SYSTEMS.items()},
                value=self._visitor.units.name,
                on_change=lambda event: self._change_units(event.value),
            ).mark("units")
            self._units.props('dense outlined options-dense aria-label="Units"')
            self._shade = ui.button(icon="contrast", on_click=self._change_shade).mark("shade")
            self._shade.props('flat aria-label="Dark or light"')
            if self._bench.access.login_needed:
                leave = (
                    ui.button(icon="logout")
                    .mark("logout")
                    .props(f'flat aria-label="Log out {self._visitor.user}"')
                )
                leave.on(
                    "click",
                    js_handler=_LOG_OUT,
                )
        for part in (_STOP, _STOP_FAILED, _STALE):
            ui.html(part, sanitize=False).style("display: contents")
        self._unlinked = ui.label("The controller does not answer. What the page shows is old.")
        self._unlinked.classes("bench-banner").props("role=alert").mark("unlinked")

    def refresh(self) -> None:
        """Show what has changed; whose login has ended, or whose token was taken away, sees nothing more."""
        if role_of(self._bench, self._visitor) is None:
            self._leave()
            return
        link, status, hello = self._bench.link, self._bench.link.status, self._bench.link.hello
        self._beat.props["data-beat"] = next(self._beats)
        self._beat.update()
        self._machine.set_text(hello.machine if hello else "servo_ctrl")
        self._unlinked.set_visibility(not link.connected)
        if link.connected != self._linked:
            self._linked = link.connected
            ui.query("body").classes(**{"remove" if link.connected else "add": "bench-unlinked"})
        stage = shown_stage(status)
        self._stage.set_text(f"{stage.sign} {stage.word}")
        self._stage.classes(stage.tone, remove=" ".join(set(PILLS.split()) - {stage.tone}))
        if status is not None:
            newest = status.events[-1] if status.events else None
            self._event.set_text(f"cycle {newest.cycle}: {newest.text}" if newest else "no events yet")
            missed = f", {status.missed_ticks} ticks missed" if status.missed_ticks else ""
            self._count.set_text(f"cycle {status.cycles:,}{missed}".replace(",", "\N{THIN SPACE}"))
        self._show_control()

    def _leave(self) -> None:
        if not self._left:
            self._left = True
            ui.navigate.to(LOGIN)
            ui.timer(LEAVES_S, self._client.delete, once=True)

    def _show_control(self) -> None:
        now_s = time.monotonic()
        holder, visitor = self._bench.control.holder(now_s), self._visitor
        mine = holder is not None and holder.browser == visitor.browser
        if holder is None:
            shown, offered = "Nobody has control", "Take control"
        elif mine:
            shown, offered = "You have control", "Release"
        else:
            shown, offered = f"{holder.user} ({holder.address}) has control", "Take over"
        self._holder.set_text(shown)
        self._take.set_text(offered)
        self._take.set_visibility(visitor.role >= Role.OPERATE)
        change = self._bench.control.last
        if change.number > self._seen:
            self._seen = change.number
            lost = change.before is not None and change.before.browser == visitor.browser
            if lost and change.after is not None:
                tell(f"{change.after.user} ({change.after.address}) has taken over control.", "negative")

    async def _take_control(self) -> None:
        control, visitor, now_s = self._bench.control, self._visitor, time.monotonic()
        holder = control.holder(now_s)
        if holder is not None and holder.browser == visitor.browser:
            control.release(visitor.browser, now_s)
            await ask(self._bench, visitor, "release_control", quiet=True)
        elif holder is None or await confirmed(
            f"{holder.user} has control. Take it over?", TAKE_OVER, "Take over"
        ):
            control.take(visitor.browser, visitor.user, visitor.address, time.monotonic())
            await ask(self._bench, visitor, "take_control", quiet=True)
        self.refresh()

    def _change_units(self, name: str) -> None:
        self._visitor.units = SYSTEMS[name]
        remember(UNITS_COOKIE, name)

    def _change_shade(self) -> None:
        self._visitor.dark = not self._visitor.dark
        self._dark.value = self._visitor.dark
        remember(DARK_COOKIE, "1" if self._visitor.dark else "0")
