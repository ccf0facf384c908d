"""Drive: what the axes do and are, switching them on and off, homing, jogging, and faults with what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

from servo_ctrl.hmi.axis_card import AxisCard
from servo_ctrl.hmi.bench import ask
from servo_ctrl.hmi.faults import faults_of
from servo_ctrl.hmi.jog import SPEEDS_M_S, JogSpeed
from servo_ctrl.hmi.parts import Table, card, when_greeted
from servo_ctrl.hmi.stages import shown_stage

if TYPE_CHECKING:
    from collections.abc import Callable

    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.config.local_status import Stage, Status
    from servo_ctrl.hmi.bench import Bench, Visitor
    from servo_ctrl.hmi.faults import Fault
    from servo_ctrl.hmi.units import Units

TITLE = "Drive"
EVENTS_SHOWN = 40
POSSIBLE: dict[str, frozenset[Stage]] = {
    "enable": frozenset({"standby"}),
    "disable": frozenset({"ready", "running"}),
    "home": frozenset({"ready"}),
}
"""Commands, and the stages in which they have a sense."""


def build(bench: Bench, visitor: Visitor) -> None:
    """The page's content."""

    def make(hello: Hello) -> Callable[[], None]:
        speed = JogSpeed()
        faults = Faults()
        with ui.element("div").classes("bench-grid"):
            axes = [AxisCard(bench, visitor, axis, place, speed) for place, axis in enumerate(hello.axes)]
        with ui.element("div").classes("bench-narrow-wide"):
            with ui.element("div").classes("bench-column"):
                power = Power(bench, visitor)
                jogging = JogSettings(visitor, speed)
            with ui.element("div").classes("bench-column"):
                events = Events()
                nodes = Nodes()

        def refresh() -> None:
            status = bench.link.status
            if status is None:
                return
            for axis in axes:
                axis.refresh(status)
            for part in (faults, power, events, nodes):
                part.refresh(status)
            jogging.refresh()

        return refresh

    when_greeted(bench, make)


class Power:
    """Switching on and off, and homing."""

    def __init__(self, bench: Bench, visitor: Visitor) -> None:
        self._bench, self._visitor = bench, visitor
        with card("Power", "power"):
            with ui.element("div").classes("bench-row"):
                self._buttons = {
                    "enable": self._button("Enable", "enable", "power_settings_new"),
                    "disable": self._button("Disable", "disable", "power_off"),
                    "home": self._button("Home", "home", "home"),
                }
            self._reason = ui.label().classes("bench-faint").mark("stage-reason")

    def _button(self, text: str, command: str, icon: str) -> ui.button:
        async def press() -> None:
            await ask(self._bench, self._visitor, "command", command=command)

        button = ui.button(text, icon=icon, on_click=press).mark(command)
        return button.props("outline" if command != "enable" else "unelevated").style("flex: 1 1 0")

    def refresh(self, status: Status) -> None:
        """What is possible now, and why the machine stands still."""
        for command, button in self._buttons.items():
            button.set_enabled(status.stage in POSSIBLE[command])
        stage = shown_stage(status)
        self._reason.set_text(f"{stage.word}: {status.reason}" if status.reason else stage.word)


class JogSettings:
    """How fast to jog."""

    def __init__(self, visitor: Visitor, speed: JogSpeed) -> None:
        self._visitor, self._speed = visitor, speed
        self._units: Units | None = None
        with card("Jog speed", "jog-settings"):
            self._unit = ui.label().classes("bench-faint")
            self._choice = ui.toggle({}, on_change=self._choose).mark("jog-speed")
            self._choice.props('no-caps unelevated spread aria-label="Jog speed"').classes("num")
            ui.label(
                "Hold a button or an arrow key; the axis brakes when it is let go, when the page loses "
                "the focus or its connection, and before the end of the travel."
            ).classes("bench-faint")
        self.refresh()

    def refresh(self) -> None:
        """In the visitor's units."""
        if self._visitor.units is not self._units:
            self._units = self._visitor.units
            scale = self._units.velocity
            options = {speed: f"{speed * scale.factor:.3g}" for speed in SPEEDS_M_S}
            self._unit.set_text(f"in {scale.unit}, at most what the axis allows")
            self._choice.set_options(options, value=self._speed.value_m_s)

    def _choose(self) -> None:
        if self._choice.value is not None:
            self._speed.value_m_s = float(self._choice.value)


class Faults:
    """What keeps the machine from working, and what to do; not there while nothing does."""

    def __init__(self) -> None:
        self._shown: list[Fault] = []
        self._body = ui.element("div").classes("bench-grid").props("role=alert").mark("faults")
        self._body.set_visibility(False)

    def refresh(self, status: Status) -> None:
        """The present ones."""
        found = faults_of(status)
        if found == self._shown:
            return
        self._shown = found
        self._body.set_visibility(bool(found))
        self._body.clear()
        with self._body:
            for fault in found:
                with ui.element("div").classes("bench-note bad").mark("fault"):
                    with ui.element("b"):
                        ui.label(f"\N{HEAVY MULTIPLICATION X} {fault.where}: {fault.advice.what}")
                    ui.label(fault.advice.todo)
                    ui.label(fault.detail).classes("bench-faint").style("overflow-wrap: anywhere")


class Events:
    """The newest events of the controller, the newest first."""

    def __init__(self) -> None:
        self._shown: object = None
        with card("Events", "events"):
            self._body = ui.element("div").classes("bench-list num").props("tabindex=0 role=log")

    def refresh(self, status: Status) -> None:
        """The newest ones."""
        newest = status.events[-EVENTS_SHOWN:]
        if newest == self._shown:
            return
        self._shown = newest
        self._body.clear()
        with self._body:
            for event in reversed(newest):
                with ui.element("div"):
                    ui.label(f"{event.cycle:,}".replace(",", "\N{THIN SPACE}")).classes("bench-faint")
                    ui.label(event.text).style("overflow-wrap: anywhere")


class Nodes:
    """Everybody on the bus."""

    def __init__(self) -> None:
        with card("Nodes", "nodes"):
            self._table = Table("node-table", ("Node", "No.", "State"))

    def refresh(self, status: Status) -> None:
        """As they were heard."""
        rows = []
        for node in status.nodes:
            sign = "\N{BLACK CIRCLE}" if node.nmt_state == "operational" else "\N{HEAVY MULTIPLICATION X}"
            rows.append((node.name, str(node.node_id), f"{sign} {node.nmt_state.replace('_', ' ')}"))
        self._table.show(rows)
