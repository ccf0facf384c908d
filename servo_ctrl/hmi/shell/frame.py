"""The frame around every page: links, the machine's stage, who has control, units, theme and STOP."""

import itertools
import time
from collections.abc import Callable, Mapping
from html import escape

from nicegui import ui

from servo_ctrl.hmi.access.guard import LOGIN
from servo_ctrl.hmi.access.users import Role
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import LANGUAGE_COOKIE, LANGUAGES, tr, word
from servo_ctrl.hmi.shell.event_texts import when
from servo_ctrl.hmi.shell.live_content import REFRESH_S
from servo_ctrl.hmi.shell.live_elements import LiveLabel
from servo_ctrl.hmi.shell.machine_stage import shown_stage
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.overload import RecentShare, overload_text
from servo_ctrl.hmi.shell.parts import Pill, button, confirmed, div, faint, named, notify
from servo_ctrl.hmi.shell.units import UNIT_SYSTEMS, grouped

UNITS_COOKIE, DARK_COOKIE = "bench_units", "bench_dark"
"""Preferences of a browser: unit system, dark or light. None of them is secret."""
LANGUAGE_WORDS = ", ".join(LANGUAGES.values())
"""Name of the choice of the language: in all of them, for somebody who reads one."""
LEAVE_TIME_S = 1.0
"""Time for the browser to load the login page before the server deletes the page, seconds; chosen."""
_LOG_OUT = "() => fetch('/logout', {method: 'POST'}).then(() => location.assign('/login'))"
_TAKE_OVER_DETAILS = word("The present motion continues. They are notified.")


def build_page(
    page: OpenPage, path: str, titles: Mapping[str, str], build: Callable[[OpenPage], None]
) -> None:
    """Build the frame with a page's content in it; `titles` are those of all pages by address."""
    frame = PageFrame(page, path, titles)
    with ui.element("main").classes("bench-content").mark("content"):
        build(page)
    ui.timer(REFRESH_S, frame.refresh)


class PageFrame:
    """Head and foot of one open page."""

    def __init__(self, page: OpenPage, path: str, titles: Mapping[str, str]) -> None:
        self._page, self._control = page, page.services.control
        self._client, self._left = ui.context.client, False
        self._beats, self._shown_connected = itertools.cycle(range(1000)), True
        self._shown_handover = self._control.last
        self._dark, self._ticks = ui.dark_mode(page.dark), RecentShare()
        with ui.header(bordered=False).classes("bench-head"):
            self._build_head(path, titles)
        with ui.footer(bordered=False).classes("bench-foot"):
            self._event = ui.label().mark("last-event")
            self._cycles = LiveLabel().classes("num bench-optional").mark("cycle-count")
            self._beat = LiveLabel("0").classes("bench-beat").style("display: none")
        self.refresh()

    def _build_head(self, path: str, titles: Mapping[str, str]) -> None:
        with div("bench-row bench-who").style("flex-wrap: nowrap; min-width: 0"):
            self._machine = ui.label().classes("bench-machine").mark("machine")
            self._stage = Pill("stage")
        with div("bench-bar"):
            with ui.element("nav").classes("bench-nav") as pages:
                named(pages, tr("Pages"))
                for address, title in titles.items():
                    link = ui.link(tr(title), address).mark(f"link-{title.lower()}")
                    if address == path:
                        link.props("aria-current=page")
            self._build_looks()
        with div("bench-tools bench-control"):
            self._holder = faint().mark("control-holder")
            self._take = button(tr("Take control"), self._take_or_release, "take-control", look="unelevated")
        for part in _safety_parts():
            ui.html(part, sanitize=False).style("display: contents")
        self._unlinked = ui.label(tr("The controller does not answer. The page shows old values."))
        self._unlinked.classes("bench-banner").props("role=alert").mark("unlinked")
        self._overload = ui.label().classes("bench-banner").props("role=alert").mark("overload")

    def _build_looks(self) -> None:
        with div("bench-tools bench-looks"):
            units = ui.select(
                {name: system.label for name, system in UNIT_SYSTEMS.items()},
                value=self._page.units.name,
                on_change=lambda event: self._change_units(event.value),
            )
            named(units.props("options-dense"), tr("Units")).mark("units")
            languages = ui.select(
                {code: code.upper() for code in LANGUAGES},
                value=self._page.language,
                on_change=lambda event: _change_language(event.value),
            )
            named(languages.props("borderless options-dense hide-dropdown-icon"), LANGUAGE_WORDS).mark(
                "language"
            )
            theme = ui.button(icon="contrast", on_click=self._change_theme).mark("shade")
            named(theme.props("flat"), tr("Dark or light"))
            if self._page.services.access.login_needed:
                leave = ui.button(icon="logout").mark("logout")
                named(leave.props("flat"), tr("Log out {user}", user=self._page.user)).on(
                    "click", js_handler=_LOG_OUT
                )

    def refresh(self) -> None:
        """Show the newest state; a visitor whose login has ended goes to the login page."""
        page, link = self._page, self._page.link
        hello, status = link.hello, link.status
        if page.current_role() is None:
            if not self._left:
                self._left = True
                ui.navigate.to(LOGIN)
                ui.timer(LEAVE_TIME_S, self._client.delete, once=True)
            return
        self._beat.set_text(str(next(self._beats)))
        self._machine.set_text(hello.machine if hello else "servo_ctrl")
        self._unlinked.set_visibility(not link.connected)
        if link.connected != self._shown_connected:
            self._shown_connected = link.connected
            ui.query("body").classes(**{"remove" if link.connected else "add": "bench-unlinked"})
        stage = shown_stage(status, jogged=self._jogged())
        overload = overload_text(self._ticks.take(status)) if status is not None else ""
        self._overload.set_text(overload)
        self._overload.set_visibility(bool(overload))
        self._stage.show(f"{stage.sign} {tr(stage.word)}", stage.tone)
        if status is not None:
            newest = status.events[-1] if status.events else None
            self._event.set_text(
                f"{when(newest)}: {controller_text(newest.text)}" if newest else tr("no events yet")
            )
            missed = tr(", {missed} ticks missed", missed=status.missed_ticks) if status.missed_ticks else ""
            self._cycles.set_text(tr("cycle {number}", number=grouped(status.cycles)) + missed)
        self._show_control()

    def _jogged(self) -> bool:
        """Whether set points move an axis that are of no step of a program."""
        link = self._page.link
        if link.rows.newest("segment") >= 0.0:
            return False
        axes = link.hello.axes if link.hello else ()
        return any(abs(link.rows.newest(f"{axis.name}.velocity_command_m_s")) > 0.0 for axis in axes)

    def _show_control(self) -> None:
        holder, browser = self._control.holder(time.monotonic()), self._page.browser
        if holder is None:
            shown, offered = tr("Nobody has control"), tr("Take control")
        elif holder.browser == browser:
            shown, offered = tr("You have control"), tr("Release")
        else:
            shown, offered = (
                tr("{user} ({address}) has control", user=holder.user, address=holder.address),
                tr("Take over"),
            )
        self._holder.set_text(shown)
        self._take.set_text(offered)
        self._take.set_visibility(self._page.role >= Role.OPERATE)
        handover = self._control.last
        if handover is not self._shown_handover:
            self._shown_handover = handover
            before, after = handover
            if before is not None and before.browser == browser and after is not None:
                notify(
                    tr("{user} ({address}) has taken over control.", user=after.user, address=after.address),
                    "negative",
                )

    async def _take_or_release(self) -> None:
        page, now_s = self._page, time.monotonic()
        holder = self._control.holder(now_s)
        if holder is not None and holder.browser == page.browser:
            self._control.release(page.browser, now_s)
            await page.ask("release_control", quiet=True)
        elif holder is None or await confirmed(
            tr("{user} has control. Take it over?", user=holder.user), tr(_TAKE_OVER_DETAILS), tr("Take over")
        ):
            self._control.take(page.browser, page.user, page.address, time.monotonic())
            await page.ask("take_control", quiet=True)
        self.refresh()

    def _change_units(self, name: str) -> None:
        self._page.units = UNIT_SYSTEMS[name]
        _store_preference(UNITS_COOKIE, name)

    def _change_theme(self) -> None:
        self._page.dark = not self._page.dark
        self._dark.value = self._page.dark
        _store_preference(DARK_COOKIE, "1" if self._page.dark else "0")


def _change_language(language: str) -> None:
    """Store the language in the browser, and reload the page."""
    _store_preference(LANGUAGE_COOKIE, language)
    ui.run_javascript("location.reload()")


def _safety_parts() -> tuple[str, ...]:
    """Return the HTML of STOP and of the banners: STOP has failed, connection lost, click lost."""
    stop = (
        f'<button type="button" id="bench-stop" data-testid="stop" '
        f'aria-label="{escape(tr("Stop the machine; key Escape"))}">'
        f"STOP<small>{escape(tr('or key Esc'))}</small></button>"
    )
    failed = tr("STOP did not reach the machine. Use the emergency stop.")
    stale = tr("The page is not connected and shows old values. Use the emergency stop if you have to.")
    unsent = tr('There was no connection: "{control}" was not carried out. Press it again.')
    unanswered = tr(
        'The connection broke as "{control}" was pressed. If it was not carried out, press it again.'
    )
    lost = (
        f'<div class="bench-banner" id="bench-lost-click" role="alert" hidden data-unsent="{escape(unsent)}" '
        f'data-unanswered="{escape(unanswered)}"></div>'
    )
    return (
        stop,
        f'<div id="bench-stop-failed" role="alert" data-text="{escape(failed)}" hidden></div>',
        f'<div class="bench-banner" id="bench-stale-banner" role="alert">{escape(stale)}</div>',
        lost,
    )


def _store_preference(name: str, value: str) -> None:
    """Store a cookie in the browser for a year."""
    ui.run_javascript(f"document.cookie = '{name}={value}; path=/; max-age=31536000; samesite=strict'")
