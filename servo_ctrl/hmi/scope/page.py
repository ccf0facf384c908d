"""The Scope page: any channels of the recording over time, triggered, measured and saved."""

import asyncio
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial

from nicegui import ui

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.access.users import Role
from servo_ctrl.hmi.charts.frames import payloads_of
from servo_ctrl.hmi.charts.live_chart import LiveChart, refresh_paced
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.scope.appearance import ScopeLayout, ShownChannel, panes_of, scope_options, time_unit
from servo_ctrl.hmi.scope.capture_files import save_capture
from servo_ctrl.hmi.scope.controls import ScopeChoices, ScopeFields, first_choices
from servo_ctrl.hmi.scope.cursors import CursorReadings
from servo_ctrl.hmi.scope.event_marks import event_marks, marks_text
from servo_ctrl.hmi.scope.fixed_scales import FixedScales
from servo_ctrl.hmi.scope.measurements import MeasurementTable, between
from servo_ctrl.hmi.scope.set_controls import MathFields, SetFields
from servo_ctrl.hmi.scope.spectrum import spectrum_figure
from servo_ctrl.hmi.scope.stream import CapturedRows, ScopeStream, clock_text, missing_cycles
from servo_ctrl.hmi.shell.live_content import REFRESH_S, Plot, connected_content
from servo_ctrl.hmi.shell.live_elements import LiveLabel
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import Pill, button, card, div, errors_notified, faint, note, panel
from servo_ctrl.hmi.shell.plots import Look

TITLE = word("Scope")


def build(page: OpenPage) -> None:
    """Build the content of the page; rebuild it when a machine with other channels answers."""
    content = connected_content(
        page, lambda hello: ScopeContent(page, hello).refresh, lambda hello: hello.channels
    )
    refresh_paced(content)


class ScopeContent:
    """The scope of one machine; rebuilt for another channel set."""

    def __init__(self, page: OpenPage, hello: Hello) -> None:
        self._page, self._hello = page, hello
        self._place = div("bench-column")
        self._show(first_choices(hello))

    async def refresh(self, status: MachineStatus) -> None:
        """Refresh the scope that is shown."""
        await self._scope.refresh(status)

    def _show(self, choices: ScopeChoices, name: str = "") -> None:
        self._place.clear()
        with self._place:
            self._scope = Scope(
                self._page, self._hello, choices, partial(SetFields, on_load=self._show, shown=name)
            )


class Scope:
    """One open scope on one machine."""

    def __init__(
        self,
        page: OpenPage,
        hello: Hello,
        choices: ScopeChoices,
        add_sets: Callable[[OpenPage, ScopeChoices], object],
    ) -> None:
        self._page, self._hello, self._choices = page, hello, choices
        self._marks: tuple[object, ...] = ()
        """The event marks that are drawn."""
        self._stream = ScopeStream(payloads_of(page.link))
        self._readings_s = time.monotonic()
        """When the readings were refreshed last."""
        self._drawn_for: Look | None = None
        """None: the chart has to be redrawn."""
        self._saving = False
        self._stopped = page.link.status is None or page.link.status.stage.stopped
        """Whether the last status was that of a machine that stops or has stopped."""
        with panel(tr("Settings of the scope")):
            self._fields = ScopeFields(hello, self._choices, self._on_change)
            with div("bench-row"):
                self._hold = button(
                    tr("Hold"), self._toggle_hold, "scope-hold", icon="pause", look="unelevated"
                )
                self._arm = button(tr("Arm"), self._rearm, "scope-arm", icon="adjust")
                button(tr("Save view"), self._save, "scope-save", icon="save")
                self._state = Pill("scope-state")
                self._rate = LiveLabel().classes("bench-faint num").mark("scope-rate")
                self._clock = LiveLabel().classes("bench-faint num").mark("scope-clock")
                button(tr("Full view"), self._end_zoom, "scope-whole", look="flat")
            add_sets(page, choices)
            MathFields(hello, choices, self._on_math)
        with panel(tr("Scope")):
            self._chart = LiveChart("scope-chart", tr("Channels over time"), self._stream.resend)
            self._chart.style("width: 100%; height: max(360px, 58vh); touch-action: pan-y")
            self._events = faint().classes("num").mark("scope-events")
            self._events.style("white-space: pre-line; font-size: 12px; overflow-wrap: anywhere")
            self._gap = note("scope-gap")
            self._saved = div("bench-row")
        with panel(tr("Cursors and scales")):
            self._cursors = CursorReadings(self._choices, hello.period_s, lambda: self._on_change("look"))
            self._scales = FixedScales(self._choices, lambda: self._on_change("look"))
        with card(tr("Measured over the picture, or between the cursors"), "scope-measurements"):
            self._measured = MeasurementTable()
            self._spectrum_open = ui.expansion(tr("Spectrum")).props("dense").mark("scope-spectrum")
            with self._spectrum_open:
                self._spectrum = Plot("scope-spectrum-plot", tr("Amplitude spectrum of the channels"), 300)
        self._chart.on_size(self._stream.set_width)
        self._chart.on_pick(self._cursors.pick)
        self._on_math()
        self._on_change("capture")

    async def refresh(self, status: MachineStatus) -> None:
        """Send what is new to the chart, and refresh the readings five times a second."""
        ring = self._page.link.rows
        self._redraw()
        stopped = status.stage.stopped
        if stopped and not self._stopped:  # a stop is a fault to the trigger
            self._stream.note_stop(ring)
        self._stopped = stopped
        if self._chart.ready:
            frame = self._stream.frame(ring)
            if frame is not None:
                await self._chart.send(frame, 1 + len(self._stream.columns), self._stream.origin)
        elapsed_s = time.monotonic() - self._readings_s
        if elapsed_s >= REFRESH_S:
            self._rate.set_text(tr("{rate:.0f} pictures/s", rate=self._chart.frame_rate(elapsed_s)))
            self._readings_s += elapsed_s
            self._show_readings()

    def _on_change(self, what: str) -> None:
        if what == "capture":
            self._fields.refresh()
            self._stream.settings = self._choices.settings(self._hello.period_s)
            self._stream.trigger = self._choices.trigger(self._hello, self._page.units)
            self._stream.arm(self._page.link.rows)
            self._cursors.rescale()
        self._drawn_for = None

    def _on_math(self) -> None:
        self._stream.compute(self._choices.math(self._hello), self._hello.period_s)
        self._on_change("look")

    def _redraw(self) -> None:
        """Redraw the chart when something other than its data has changed."""
        page, choices = self._page, self._choices
        if self._drawn_for == page.look:
            return
        if self._drawn_for is not None and self._drawn_for.units != page.units:
            choices.limits.clear()  # they were in the other unit
            self._stream.trigger = choices.trigger(self._hello, page.units)
        self._drawn_for = page.look
        channels = choices.shown_channels(self._hello, page.units)
        level = (choices.source, choices.level) if choices.kind in {"rising", "falling"} else None
        layout = ScopeLayout(choices.span_s, choices.before_s(), choices.cursors, page.look.theme, level)
        self._stream.columns = tuple(channel.place for channel in channels)
        self._chart.show(*scope_options(channels, layout, self._hello.period_s))
        self._fields.show_unit(page.units)
        self._scales.show(channels)

    def _show_readings(self) -> None:
        stream, ring = self._stream, self._page.link.rows
        rows = stream.rows(ring)
        channels = self._choices.shown_channels(self._hello, self._page.units)
        self._cursors.refresh(rows, stream.origin, channels)
        period_s = self._hello.period_s
        self._measured.refresh(rows, stream.origin, channels, self._choices.cursors, period_s)
        self._show_marks(rows, channels)
        if self._spectrum_open.value:
            values = between(rows, stream.origin, self._choices.cursors, period_s)
            key = (rows.first, len(values), [channel.name for channel in channels], self._page.look)
            self._spectrum.show(
                str(key),
                lambda: spectrum_figure(values, channels, period_s, self._page.look.theme),
                at_most_every_s=1.0,
            )
        self._clock.set_text(clock_text(self._page.link.status, ring, stream.origin, period_s))
        missing = missing_cycles(rows, ring.place("cycle"))
        gap = tr("{missing} cycles of this picture have no row: time is too short by them.", missing=missing)
        self._gap.set_text(gap if missing > 0 else "")
        self._state.show(*stream.state())
        self._hold.set_text(tr("Continue") if stream.hold else tr("Hold"))
        self._hold.props(f"icon={'play_arrow' if stream.hold else 'pause'}")
        self._arm.set_visibility(not stream.settings.free)

    def _show_marks(self, rows: CapturedRows, channels: Sequence[ShownChannel]) -> None:
        """Mark the events within the picture; sent to the browser only where the marks have changed."""
        status, period_s = self._page.link.status, self._hello.period_s
        place = self._page.link.rows.place("cycle")
        events = status.events if status is not None else ()
        marks = event_marks(events, rows, self._stream.origin, place, period_s)
        panes = len(panes_of(channels))
        if (marks, panes) != self._marks:
            self._marks = (marks, panes)
            factor = time_unit(self._choices.span_s).factor
            places = [(mark.at_s * factor, str(number)) for number, mark in enumerate(marks, start=1)]
            self._chart.show_marks(places, panes)
            self._events.set_text(marks_text(marks))

    def _end_zoom(self) -> None:
        self._chart.show_whole()

    def _toggle_hold(self) -> None:
        self._stream.toggle_hold(self._page.link.rows)
        self._show_readings()

    def _rearm(self) -> None:
        self._stream.arm(self._page.link.rows)
        self._show_readings()

    async def _save(self) -> None:
        page = self._page
        if self._saving or not page.permits(Role.OPERATE):  # it writes on the controller's disk
            return
        self._saving = True
        try:
            with errors_notified():
                save = partial(save_capture, origin=self._stream.origin, taken=datetime.now(UTC))
                rows = self._stream.rows(page.link.rows)
                channels = self._choices.shown_channels(self._hello, page.units)
                directory = await asyncio.to_thread(
                    save, page.services.recordings, self._hello, rows, channels
                )
                self._saved.clear()
                with self._saved:
                    ui.label(tr("Saved in {place}", place=directory)).mark("scope-saved")
                    for file in sorted(directory.iterdir()):
                        mark = f"scope-download-{file.suffix[1:]}"
                        button(file.name, partial(ui.download.file, file), mark, icon="download", look="flat")
        finally:
            self._saving = False
