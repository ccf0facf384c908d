"""The Friction page: indicators of the reversals, the learning run, and the learned versions."""

from collections.abc import Callable
from functools import partial

from nicegui import ui

from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.settings import Settings
from servo_ctrl.hmi.friction.learning_card import LearningCard
from servo_ctrl.hmi.friction.reversal_figures import (
    INDICATORS,
    MEAN,
    error_figure,
    indicator_figure,
    indicator_texts,
    newest_of_each,
)
from servo_ctrl.hmi.friction.versions import VersionsCard
from servo_ctrl.hmi.shell.live_content import Plot, when_connected
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import CHECK, WARNING, Pill, Switch, card, div, faint

TITLE = "Friction"
SWITCHES = {"compensation": "Compensation", "observer": "Disturbance observer", "screw": "Screw and take-up"}
"""By the ending of their commands, enable_ and disable_."""


def build(page: OpenPage) -> None:
    """Build the content of the page."""

    def make(hello: Hello) -> Callable[[], None]:
        with div("bench-grid"):
            axes = [AxisFrictionCard(page, axis.name) for axis in hello.axes]
        with div("bench-wide"):
            reversals = ReversalCard(page, hello)
            learning = LearningCard(page, hello)
        versions = VersionsCard(page, hello)
        refreshes = [part.refresh for part in axes]
        refreshes += [reversals.refresh, learning.refresh, versions.refresh]

        def refresh() -> None:
            for refresh_card in refreshes:
                refresh_card()

        return refresh

    when_connected(page, make)


class AxisFrictionCard:
    """One axis: its last reversal, whether learning is due, and the switches of its compensations."""

    def __init__(self, page: OpenPage, axis: str) -> None:
        self._page, self._axis = page, axis
        with card(f"Axis {axis}", f"axis-{axis}"):
            with div("bench-row apart"):
                self._mean = ui.label().classes("bench-figure").style("text-align: left").mark(f"j-{axis}")
                self._due = Pill(f"due-{axis}")
            self._required = faint().mark(f"required-{axis}")
            with div("bench-pairs"):
                self._indicators = {
                    key: self._pair(name, f"{key}-{axis}")
                    for key, name in INDICATORS.items()
                    if key != MEAN  # it stands above in large figures
                }
                self._count = self._pair("reversals", f"reversals-{axis}")
                self._version = self._pair("learned", f"version-{axis}")
            with div("bench-row"):
                self._switches = {
                    name: Switch(text, f"{name}-{axis}", partial(self._flip, name))
                    for name, text in SWITCHES.items()
                }

    @staticmethod
    def _pair(name: str, mark: str) -> ui.label:
        ui.label(name)
        return ui.label().classes("num").mark(mark)

    def refresh(self) -> None:
        """Show the state of the axis."""
        status = self._page.status
        axis = next((axis for axis in status.axes if axis.name == self._axis), None) if status else None
        if status is not None and axis is not None:
            self._show(axis, status.settings)

    def _show(self, axis: AxisStatus, settings: Settings) -> None:
        units = self._page.units
        texts = indicator_texts(axis, settings.required_m, units)
        for key, label in self._indicators.items():
            label.set_text(texts[key].text)
        self._mean.set_text(texts[MEAN].text)
        above = " \N{EM DASH} above it" if texts[MEAN].above_required else ""
        self._required.set_text(f"J; required {units.error.with_unit(settings.required_m)}{above}")
        if axis.learning_due:
            self._due.show(f"{WARNING} learning due", "warn")
        else:
            self._due.show(f"{CHECK} settled", "calm")
        self._count.set_text(str(axis.reversals))
        moment = axis.learned_at.replace("T", " ")[:16]
        self._version.set_text(f"version {axis.version} of {moment}" if axis.version else "nothing in use")
        self._switches["compensation"].show(axis.compensation_enabled)
        self._switches["observer"].show(axis.observer_enabled)
        self._switches["screw"].show(axis.screw.enabled)

    async def _flip(self, name: str, on: bool) -> None:
        await self._page.command(f"{'enable' if on else 'disable'}_{name}", self._axis)


class ReversalCard:
    """The indicators over time, and the error after the last reversals."""

    def __init__(self, page: OpenPage, hello: Hello) -> None:
        self._page, self._hello = page, hello
        with card("Reversals", "reversals"):
            self._choice = ui.toggle(INDICATORS, value=MEAN).mark("indicator")
            self._choice.props("no-caps unelevated").style("flex-wrap: wrap")
            self._over_time = Plot("indicator-plot", "Indicator of each reversal over time")
            self._none = faint("No reversal was seen yet: run a program.")
            self._errors = Plot("error-plot", "Error after the last reversal of each axis and direction", 220)

    def refresh(self) -> None:
        """Draw the reversals since the page's process has connected."""
        page, status = self._page, self._page.status
        if status is None:
            return
        reversals = tuple(page.link.reversals)
        newest = reversals[-1].report.cycle if reversals else None
        self._none.set_visibility(not reversals)
        units, dark, required_m = page.units, page.dark, status.settings.required_m
        key = (len(reversals), newest, units.name, dark)
        indicator = str(self._choice.value)
        self._over_time.show(
            (*key, indicator, required_m),
            lambda: indicator_figure(
                reversals,
                [axis.name for axis in self._hello.axes],
                indicator,
                required_m=required_m,
                period_s=self._hello.period_s,
                units=units,
                dark=dark,
            ),
        )
        self._errors.show(key, lambda: error_figure(newest_of_each(reversals), units, dark=dark))
