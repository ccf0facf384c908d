"""The Friction page: indicators of the reversals, the learning run, and the learned versions."""

import math
import statistics
from collections.abc import Callable, Sequence
from functools import partial

from nicegui import ui

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.friction.figures import (
    INDICATORS,
    MEAN,
    MIN_REVERSALS,
    OUTLIER_RATIO,
    error_figure,
    indicator_figure,
    newest_of_each,
)
from servo_ctrl.hmi.friction.learning_card import LearningCard
from servo_ctrl.hmi.friction.recent_reversals import recent_reversals_of
from servo_ctrl.hmi.friction.versions import VersionsCard
from servo_ctrl.hmi.languages.texts import tr, translated, word
from servo_ctrl.hmi.shell.live_content import Plot, when_connected
from servo_ctrl.hmi.shell.open_page import OpenPage, PageServices
from servo_ctrl.hmi.shell.parts import Pill, Switch, card, div, faint, pairs, toggle
from servo_ctrl.hmi.shell.units import DisplayUnit

TITLE = word("Friction")
SWITCHES = {
    "compensation": word("Compensation"),
    "observer": word("Disturbance observer"),
    "screw": word("Screw and lost motion"),
    "waveform": word("Learned waveform"),
}
"""By the ending of their commands, ENABLE_ and DISABLE_."""
PAIRS = {key: name for key, name in INDICATORS.items() if key != MEAN} | {
    "reversals": word("reversals"),
    "version": word("learned"),
}
"""Names of the values of an axis below J, which stands above them in large figures."""


def prepare(services: PageServices) -> None:
    """Observe from the start of the process on which reversals the present compensation had a part in."""
    recent_reversals_of(services.link)


def build(page: OpenPage) -> None:
    """Build the content of the page."""

    def make(hello: Hello) -> Sequence[Callable[[MachineStatus], None]]:
        with div("bench-grid"):
            axes = [AxisFrictionCard(page, axis.name) for axis in hello.axes]
        with div("bench-wide"):
            reversals = ReversalCard(page, hello)
            learning = LearningCard(page, hello)
        versions = VersionsCard(page, hello)
        return [*(axis.refresh for axis in axes), reversals.refresh, learning.refresh, versions.refresh]

    when_connected(page, make)


class AxisFrictionCard:
    """One axis: its last reversal, whether learning is due, and the switches of its compensations."""

    def __init__(self, page: OpenPage, axis: str) -> None:
        self._page, self._axis = page, axis
        with card(tr("Axis {axis}", axis=axis), f"axis-{axis}"):
            with div("bench-row apart"):
                self._mean = ui.label().classes("bench-figure").style("text-align: left").mark(f"j-{axis}")
                self._due = Pill(f"due-{axis}")
            self._required = faint().mark(f"required-{axis}")
            with div("bench-pairs"):
                self._values = pairs(translated(PAIRS), f"{{}}-{axis}")
            self._suspended = Pill(f"suspended-{axis}")
            self._suspended.show(tr("⚠ suspended: a tuning moves the axis, no compensation acts"), "warn")
            with div("bench-row"):
                self._switches = {
                    name: Switch(tr(text), f"{name}-{axis}", partial(self._flip, name))
                    for name, text in SWITCHES.items()
                }

    def refresh(self, status: MachineStatus) -> None:
        """Show the state of the axis."""
        axis = next((axis for axis in status.axes if axis.name == self._axis), None)
        if axis is None:
            return
        error, required_m = self._page.units.error, status.settings.required_m
        moment = axis.learned_at.replace("T", " ")[:16]
        texts = {key: error.with_unit(getattr(axis.last, key, math.nan)) for key in INDICATORS}
        texts["reversals"] = str(axis.reversals)
        texts["version"] = (
            tr("version {version} of {moment}", version=axis.version, moment=moment)
            if axis.version
            else tr("nothing in use")
        )
        for key, label in self._values.items():
            label.set_text(texts[key])
        recent = recent_reversals_of(self._page.link)
        recent_errors_m = recent.recent_errors_m(self._axis)
        self._mean.set_text(error.with_unit(median_error_m(recent_errors_m, axis.error_mean_m)))
        if recent.changed(self._axis) and axis.reversals:
            required = error.with_unit(required_m)
            self._required.set_text(
                tr(
                    "J from before the compensation was changed: run a program; required {required}",
                    required=required,
                )
            )
        else:
            self._required.set_text(requirement_text(recent_errors_m, axis.error_mean_m, required_m, error))
        if axis.learning_due:
            self._due.show(tr("⚠ learning due"), "warn")
        elif not axis.reversals:
            self._due.show(tr("… no reversal yet"), "calm")
        else:
            self._due.show(tr("✓ settled"), "calm")
        self._suspended.label.set_visibility(axis.compensation_suspended)
        self._switches["compensation"].show(axis.compensation_enabled)
        self._switches["observer"].show(axis.observer_enabled)
        self._switches["screw"].show(axis.screw.enabled)
        self._switches["waveform"].show(axis.waveform.enabled)

    async def _flip(self, name: str, on: bool) -> None:
        await self._page.command(Command[f"{'ENABLE' if on else 'DISABLE'}_{name.upper()}"], self._axis)


def median_error_m(recent_m: Sequence[float], last_m: float) -> float:
    """Return the median J of the last reversals; that of the very last where they are too few."""
    return statistics.median(recent_m) if len(recent_m) >= MIN_REVERSALS else last_m


def requirement_text(recent_m: Sequence[float], last_m: float, required_m: float, error: DisplayUnit) -> str:
    """Return the text on the shown J: its name, whether it exceeds J_required, and an outlier at the end."""
    shown_m = median_error_m(recent_m, last_m)
    text = tr("J; required {required}", required=error.with_unit(required_m))
    if len(recent_m) >= MIN_REVERSALS:
        required = error.with_unit(required_m)
        text = tr(
            "J, median of the last {count}; required {required}", count=len(recent_m), required=required
        )
    if shown_m > required_m:
        text += tr(" — above it")
    if len(recent_m) >= MIN_REVERSALS and last_m > OUTLIER_RATIO * shown_m:
        text += tr("; the last one is an outlier: {last}", last=error.with_unit(last_m))
    return text


class ReversalCard:
    """The indicators over time, and the error after the last reversals."""

    def __init__(self, page: OpenPage, hello: Hello) -> None:
        self._page, self._hello = page, hello
        with card(tr("Reversals"), "reversals"):
            self._choice = toggle(translated(INDICATORS), "indicator", MEAN).style("flex-wrap: wrap")
            self._over_time = Plot("indicator-plot", tr("Indicator of each reversal over time"))
            self._none = faint(tr("No reversal was seen yet: run a program."))
            self._errors = Plot(
                "error-plot", tr("Error after the last reversal of each axis and direction"), 220
            )

    def refresh(self, status: MachineStatus) -> None:
        """Draw the reversals since the page's process has connected."""
        page, required_m = self._page, status.settings.required_m
        reversals = tuple(page.link.reversals)
        newest = reversals[-1].report.cycle if reversals else None
        self._none.set_visibility(not reversals)
        look = page.look
        key = (len(reversals), newest, look)
        indicator = str(self._choice.value)
        self._over_time.show(
            (*key, indicator, required_m),
            lambda: indicator_figure(
                reversals, [axis.name for axis in self._hello.axes], indicator, required_m, look
            ),
        )
        self._errors.show(key, lambda: error_figure(newest_of_each(reversals), look))
