"""Friction: what reversals cost, whether learning is due, learning itself, and what was learned."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from nicegui import ui

from servo_ctrl.hmi.bench import ask
from servo_ctrl.hmi.friction_view import (
    INDICATORS,
    error_figure,
    indicator_figure,
    indicators_of,
    newest_of_each,
)
from servo_ctrl.hmi.pages.friction_learned import Versions
from servo_ctrl.hmi.pages.friction_learning import LearningRun
from servo_ctrl.hmi.parts import Plot, Switch, card, when_greeted

if TYPE_CHECKING:
    from collections.abc import Callable

    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.config.local_status import AxisState, SettingsState
    from servo_ctrl.hmi.bench import Bench, Visitor

TITLE = "Friction"
SWITCHES = {"compensation": "Compensation", "observer": "Disturbance observer", "screw": "Screw and take-up"}
"""By the end of their commands, enable_ and disable_."""
DUE, SETTLED = "\N{WARNING SIGN} learning due", "\N{CHECK MARK} settled"


def build(bench: Bench, visitor: Visitor) -> None:
    """The page's content."""

    def make(hello: Hello) -> Callable[[], None]:
        with ui.element("div").classes("bench-grid"):
            axes = [AxisCard(bench, visitor, axis.name) for axis in hello.axes]
        with ui.element("div").classes("bench-wide"):
            reversals = Reversals(bench, visitor, hello)
            learning = LearningRun(bench, visitor, hello)
        versions = Versions(bench, visitor, hello)

        def refresh() -> None:
            for axis in axes:
                axis.refresh()
            reversals.refresh()
            learning.refresh()
            versions.refresh()

        return refresh

    when_greeted(bench, make)


class AxisCard:
    """One axis: the last reversal, whether learning is due, what is switched on."""

    def __init__(self, bench: Bench, visitor: Visitor, axis: str) -> None:
        self._bench, self._visitor, self._axis = bench, visitor, axis
        with card(f"Axis {axis}", f"axis-{axis}"):
            with ui.element("div").classes("bench-row apart"):
                self._figure = ui.label().classes("bench-figure").style("text-align: left")
                self._figure.mark(f"j-{axis}")
                self._due = ui.label().classes("bench-pill").mark(f"due-{axis}").props("role=status")
            self._required = ui.label().classes("bench-faint").mark(f"required-{axis}")
            with ui.element("div").classes("bench-pairs"):
                self._indicators = {}
                for key, name in list(INDICATORS.items())[1:]:  # J stands above
                    ui.label(name)
                    self._indicators[key] = ui.label().classes("num").mark(f"{key}-{axis}")
                ui.label("reversals")
                self._count = ui.label().classes("num").mark(f"reversals-{axis}")
                ui.label("learned")
                self._version = ui.label().mark(f"version-{axis}")
            with ui.element("div").classes("bench-row"):
                self._switches = {
                    name: Switch(text, f"{name}-{axis}", partial(self._flip, name))
                    for name, text in SWITCHES.items()
                }

    def refresh(self) -> None:
        """Show what the machine says."""
        status = self._bench.link.status
        axis = next((one for one in status.axes if one.name == self._axis), None) if status else None
        if status is not None and axis is not None:
            self._show(axis, status.settings)

    def _show(self, axis: AxisState, settings: SettingsState) -> None:
        units = self._visitor.units
        found = indicators_of(axis, settings.required_m, units)
        for label, indicator in zip(self._indicators.values(), found[1:], strict=True):
            label.set_text(indicator.text)
        self._figure.set_text(found[0].text)
        above = " \N{EM DASH} above it" if found[0].above else ""
        self._required.set_text(f"J; required {units.error.with_unit(settings.required_m)}{above}")
        self._due.set_text(DUE if axis.learning_due else SETTLED)
        tones = ("warn", "calm") if axis.learning_due else ("calm", "warn")
        self._due.classes(tones[0], remove=tones[1])
        self._count.set_text(str(axis.reversals))
        moment = axis.learned_at.replace("T", " ")[:16]
        self._version.set_text(f"version {axis.version} of {moment}" if axis.version else "nothing in use")
        self._switches["compensation"].show(axis.compensation_enabled)
        self._switches["observer"].show(axis.observer_enabled)
        self._switches["screw"].show(axis.screw.enabled)

    async def _flip(self, name: str, on: bool) -> None:
        command = f"{'enable' if on else 'disable'}_{name}"
        await ask(self._bench, self._visitor, "command", command=command, axis=self._axis)


class Reversals:
    """The indicators over time, and the error after the last reversals."""

    def __init__(self, bench: Bench, visitor: Visitor, hello: Hello) -> None:
        self._bench, self._visitor, self._hello = bench, visitor, hello
        with card("Reversals", "reversals"):
            self._choice = ui.toggle(INDICATORS, value=next(iter(INDICATORS))).mark("indicator")
            self._choice.props("no-caps unelevated").style("flex-wrap: wrap")
            self._over_time = Plot("indicator-plot", "Indicator of each reversal over time")
            self._none = ui.label("No reversal was seen yet: run a program.").classes("bench-faint")
            self._trace = Plot("error-plot", "Error after the last reversal of each axis and direction", 220)

    def refresh(self) -> None:
        """Show the reversals that there are."""
        link, visitor, status = self._bench.link, self._visitor, self._bench.link.status
        if status is None:
            return
        seen = tuple(link.reversals)
        newest = seen[-1].report.cycle if seen else None
        self._none.set_visibility(not seen)
        units, dark, required_m = visitor.units, visitor.dark, status.settings.required_m
        look = (len(seen), newest, units.name, dark)
        axes = [axis.name for axis in self._hello.axes]
        indicator, period_s = str(self._choice.value), self._hello.period_s
        self._over_time.show(
            (*look, indicator, required_m),
            lambda: indicator_figure(seen, axes, indicator, required_m, period_s, units, dark=dark),
        )
        self._trace.show(look, lambda: error_figure(newest_of_each(seen), units, dark=dark))
