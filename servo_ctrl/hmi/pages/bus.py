"""Bus: load, cycle times, nodes, emergency messages, and the objects of the nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

from servo_ctrl.hmi.bench import ask
from servo_ctrl.hmi.bus_view import (
    EmcyRow,
    NodeRow,
    cycle_figure,
    cycle_summary,
    emcy_rows,
    figures,
    node_rows,
)
from servo_ctrl.hmi.pages.bus_objects import ObjectBrowser
from servo_ctrl.hmi.parts import Plot, Table, card, when_greeted

if TYPE_CHECKING:
    from collections.abc import Callable

    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.config.local_status import Status
    from servo_ctrl.hmi.bench import Bench, Visitor

TITLE = "Bus"


def build(bench: Bench, visitor: Visitor) -> None:
    """The page's content."""

    def make(hello: Hello) -> Callable[[], None]:
        traffic = Traffic(bench, visitor, hello)
        with ui.element("div").classes("bench-wide"):
            with card("Emergency messages", "emcy"):
                emcy = Table("emcy-table", ("time", "node", "code", "error register", "meaning"))
                none = ui.label("None since the start.").classes("bench-faint").mark("emcy-none")
            with card("Nodes", "nodes"):
                nodes = Table("node-table", ("node", "id", "state", "heartbeat"))
        ObjectBrowser(bench, visitor, hello)

        def refresh() -> None:
            status = bench.link.status
            if status is None:
                return
            traffic.show(status)
            nodes.show([_node_cells(row) for row in node_rows(status.nodes)])
            emcy.show([_emcy_cells(row) for row in emcy_rows(status.emcy)])
            none.set_visibility(not status.emcy)

        return refresh

    when_greeted(bench, make)


class Traffic:
    """How full the bus is and how regular the cycle."""

    def __init__(self, bench: Bench, visitor: Visitor, hello: Hello) -> None:
        self._bench, self._visitor, self._hello = bench, visitor, hello
        self._figures: dict[str, ui.label] = {}
        with ui.element("div").classes("bench-wide"):
            with card("Cycle time", "cycle"):
                self._plot = Plot("cycle-plot", "Histogram of the cycle time", 260)
                self._summary = ui.label().classes("num").mark("cycle-summary")
            with card("Traffic", "traffic"):
                self._place = ui.element("div").classes("bench-column")
                ui.button("Clear counters", on_click=self._clear).props("outline").mark("clear-counters")

    def show(self, status: Status) -> None:
        """What the machine says."""
        for figure in figures(status.bus):
            if figure.key not in self._figures:
                with self._place, ui.element("div").classes("bench-row apart"):
                    ui.label(figure.name)
                    self._figures[figure.key] = ui.label().mark(figure.key)
                    self._figures[figure.key].classes("bench-pill num").props("role=status")
            sign = "\N{WARNING SIGN} " if figure.worth_a_look else ""
            label = self._figures[figure.key]
            label.set_text(f"{sign}{figure.text}")
            tones = ("warn", "calm") if figure.worth_a_look else ("calm", "warn")
            label.classes(tones[0], remove=tones[1])
        histogram, dark = status.bus.cycle_us, self._visitor.dark
        self._summary.set_text(cycle_summary(histogram))
        self._plot.show(
            (histogram.edges_us, histogram.counts, dark),
            lambda: cycle_figure(histogram, self._hello.period_s, dark=dark),
            at_most_every_s=1.0,
        )

    async def _clear(self) -> None:
        await ask(self._bench, self._visitor, "clear_counters")


def _node_cells(row: NodeRow) -> tuple[str, ...]:
    sign = "\N{WARNING SIGN} " if row.worth_a_look else "\N{CHECK MARK} "
    return row.name, str(row.node_id), sign + row.state, row.heartbeat


def _emcy_cells(row: EmcyRow) -> tuple[str, ...]:
    return row.time, row.node, row.code, row.register, row.text
