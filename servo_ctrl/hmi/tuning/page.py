"""The Tuning page: Bode plots with margins, the proposal and its proof, of the last or a chosen tuning."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from nicegui import run, ui

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.live_content import Plot, TextTable, when_connected
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import Pill, card, choice, div, faint, named, note, problem_text
from servo_ctrl.hmi.shell.units import NO_VALUE
from servo_ctrl.hmi.tuning.bode import magnitude_figure, phase_figure, sensitivity_figure
from servo_ctrl.hmi.tuning.tuning_card import TuningCard
from servo_ctrl.hmi.tuning.tunings import (
    BodeCurves,
    TunedSetting,
    Tuning,
    TuningFigures,
    read_curves,
    read_figures,
    tunings_below,
)

TITLE = word("Tuning")
OUT = Path("out")
"""Where `servo-ctrl tune` writes without `--out`, below the directory the controller runs in."""
INDICATORS = {
    "step_peak_m": word("step of force, largest deviation"),
    "step_settling_s": word("step of force, settled to a tenth"),
    "move_peak_m": word("move, largest deviation"),
    "move_settling_s": word("move, settled after its end"),
    "circle_peak_m": word("circle, largest error"),
    "circle_rms_m": word("circle, RMS error"),
}
MARGINS = {
    "sensitivity_peak": "Ms",
    "peak_hz": word("at Hz"),
    "phase_margin_deg": word("phase margin, degrees"),
    "gain_margin_db": word("gain margin, dB"),
    "crossover_hz": word("crossover, Hz"),
    "compliance_m_n": word("compliance, µm/N"),
}


def build(page: OpenPage) -> None:
    """Build the content of the page."""

    def make(hello: Hello) -> list[Callable[[MachineStatus], None]]:
        return [TuningCards(page, hello).tuning.refresh]

    when_connected(page, make)


class TuningCards:
    """The tunings to choose from, and the chosen one."""

    def __init__(self, page: OpenPage, hello: Hello) -> None:
        self._page = page
        self._directories = [page.services.recordings, Path(hello.machine_file).parent, OUT]
        self._found: dict[str, Tuning] = {}
        with card(tr("Tunings"), "tunings"):
            with div("bench-row"):
                self._choice = choice(
                    [], tr("Tuning"), "tuning", "flex: 1 1 200px; min-width: 0", on_change=self._show
                )
                refresh = ui.button(icon="refresh", on_click=self._search)
                named(refresh.props("flat"), tr("Search for tunings again"))
            self._none = note("no-tuning", "")
        self.tuning = TuningCard(page, hello, self._search)
        self._place = div("bench-column").mark("tuning-result")
        ui.timer(0.0, self._search, once=True)

    async def _search(self, ended: Path | None = None) -> None:
        """Look for tunings, and show the one that has just ended in this directory, if any."""
        found = await run.io_bound(tunings_below, self._directories) or []
        self._found = {str(one.directory): one for one in found}
        labels = {key: f"{one.written:%Y-%m-%d %H:%M} UTC, {one.place}" for key, one in self._found.items()}
        self._none.set_text(
            "" if labels else tr("None found below {places}.", places=", ".join(map(str, self._directories)))
        )
        preferred = (str(ended), self._choice.value, *labels)
        value = next((key for key in preferred if key in labels), None)
        self._choice.set_options(labels, value=value)

    async def _show(self) -> None:
        chosen = self._found.get(str(self._choice.value or ""))
        self._place.clear()
        if chosen is None:
            return
        try:
            figures = await run.io_bound(read_figures, chosen.directory)
            curves = await run.io_bound(read_curves, chosen.directory)
        except Exception as error:  # noqa: BLE001  # a tuning without a result would be taken for none
            with self._place:
                note("tuning-problem", "bad").set_text(problem_text(error))
            return
        if figures is not None and chosen is self._found.get(str(self._choice.value or "")):
            self._place.clear()
            with self._place:
                _show_proposal(figures, chosen.directory)
                _show_proof(figures)
                if curves is None:
                    faint(tr("Bode plots are in its report.html; an earlier version wrote no bode.json."))
                else:
                    self._show_curves(figures, curves)

    def _show_curves(self, figures: TuningFigures, curves: BodeCurves) -> None:
        look = self._page.look
        with card(tr("Loop"), "loop"):
            faint(tr("L at the set point of the amplifier: position and velocity loop, notch and delays."))
            with div("bench-grid"):
                for name, label, make in (
                    ("loop-size", tr("|L|"), partial(magnitude_figure, curves.loop, tr("|L|"), 1.0, look)),
                    ("loop-phase", tr("Phase of L"), partial(phase_figure, curves.loop, look)),
                    (
                        "sensitivity",
                        tr("Sensitivity |1 / (1 + L)|, cut off at 5"),
                        partial(sensitivity_figure, curves.loop, figures.stated_ms, look),
                    ),
                ):
                    _plot(name, label, make)
        unit = look.units.error
        size = partial(magnitude_figure, curves.plant, f"{unit.unit}/N", unit.factor, look)
        with card(tr("Plant, from force to position"), "plant"), div("bench-grid"):
            _plot("plant-size", tr("Magnitude"), size)
            _plot("plant-phase", tr("Phase"), partial(phase_figure, curves.plant, look))


def _plot(mark: str, label: str, make: Callable[[], dict[str, object]]) -> None:
    with div():
        ui.label(label).classes("bench-h")
        Plot(mark, label, 300).show(mark, make)


def _show_proposal(figures: TuningFigures, directory: Path) -> None:
    with card(tr("Axis {axis} of {machine}", axis=figures.axis, machine=figures.machine), "proposal"):
        with div("bench-row"):
            state = Pill("tuning-state")
        if figures.proved:
            place = tr("✓ proved on the simulator") if figures.simulated else tr("✓ proved on the machine")
            state.show(place, "calm" if figures.simulated else "good")
        else:
            state.show(tr("⚠ not proved: do not use it"), "bad")
        ui.label(
            tr(
                "Ms {measured:.2f} was measured with the proposed values, {stated:g} was stated.",
                measured=figures.measured_ms,
                stated=figures.stated_ms,
            )
        ).mark("tuning-ms")
        values = {
            f"{section}.{key}": value
            for section, keys in figures.proposed.items()
            for key, value in keys.items()
        }
        TextTable("proposed", (tr("key of the machine file"), tr("proposed")), figures=True).show(
            [(key, _value_text(value)) for key, value in values.items()]
        )
        TextTable("margins", (tr("setting"), tr("before"), tr("after")), figures=True).show(
            _margin_rows(figures.before, figures.after)
        )
        for text in (figures.before.remark, *figures.notes):
            if text:
                faint(controller_text(text)).style("overflow-wrap: anywhere; font-size: 12px")
        faint(tr("Files: {place}", place=directory)).style("overflow-wrap: anywhere")


def _show_proof(figures: TuningFigures) -> None:
    title = tr("Proof on the simulator") if figures.simulated else tr("Proof on the machine")
    with card(title, "proof"):
        TextTable("indicators", (tr("indicator"), tr("before"), tr("after")), figures=True).show(
            [
                (tr(name), _indicator_text(key, figures.before), _indicator_text(key, figures.after))
                for key, name in INDICATORS.items()
            ]
        )


def _margin_rows(*settings: TunedSetting) -> list[tuple[str, ...]]:
    """Return one margin a row, so that the table is as narrow as a telephone."""
    stable = (tr("stable"), *(tr("yes") if setting.stable else tr("no") for setting in settings))
    return [
        stable,
        *((tr(name), *(_margin_text(key, one) for one in settings)) for key, name in MARGINS.items()),
    ]


def _margin_text(key: str, setting: TunedSetting) -> str:
    value = getattr(setting, key)
    if value is None:
        return NO_VALUE
    return f"{1e6 * value if key.endswith('_m_n') else value:.3g}"


def _indicator_text(key: str, setting: TunedSetting) -> str:
    value = getattr(setting, key)
    if value is None:
        return NO_VALUE
    return f"{1e3 * value:.3g} ms" if key.endswith("_s") else f"{1e6 * value:.3g} µm"


def _value_text(value: bool | float | str) -> str:
    if isinstance(value, bool):
        return tr("yes") if value else tr("no")
    return f"{value:g}" if isinstance(value, float) else value
