"""The Bus page: load, cycle times, nodes, emergency messages, and the objects of the nodes."""

from collections.abc import Callable, Sequence

from nicegui import ui

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.bus.bus_view import cycle_figure, cycle_summary, emcy_rows, node_rows, traffic_figures
from servo_ctrl.hmi.bus.object_browser import ObjectBrowser
from servo_ctrl.hmi.shell.live_content import Plot, TextTable, when_connected
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import WARNING, Pill, button, card, div, faint

TITLE = "Bus"


def build(page: OpenPage) -> None:
    """Build the content of the page."""

    def make(hello: Hello) -> Sequence[Callable[[MachineStatus], None]]:
        traffic = TrafficCards(page, hello)
        with div("bench-wide"):
            with card("Emergency messages", "emcy"):
                emcy = TextTable("emcy-table", ("time", "node", "code", "error register", "meaning"))
                no_emcy = faint("None since the start.").mark("emcy-none")
            with card("Nodes", "nodes"):
                nodes = TextTable("node-table", ("node", "id", "state", "heartbeat"))
        ObjectBrowser(page, hello)

        def refresh(status: MachineStatus) -> None:
            nodes.show(node_rows(status.nodes))
            emcy.show(emcy_rows(status.emcy))
            no_emcy.set_visibility(not status.emcy)

        return traffic.refresh, refresh

    when_connected(page, make)


class TrafficCards:
    """The load of the bus and the regularity of the cycle."""

    def __init__(self, page: OpenPage, hello: Hello) -> None:
        self._page, self._hello = page, hello
        self._pills: dict[str, Pill] = {}
        with div("bench-wide"):
            with card("Cycle time", "cycle"):
                self._plot = Plot("cycle-plot", "Histogram of the cycle time", 260)
                self._summary = ui.label().classes("num").mark("cycle-summary")
            with card("Traffic", "traffic"):
                self._place = div("bench-column")
                button("Clear counters", lambda: page.ask("clear_counters"), "clear-counters")

    def refresh(self, status: MachineStatus) -> None:
        """Show the figures of the bus."""
        for item in traffic_figures(status.bus):
            if item.key not in self._pills:
                with self._place, div("bench-row apart"):
                    ui.label(item.name)
                    self._pills[item.key] = Pill(item.key)
            text = f"{WARNING} {item.text}" if item.notable else item.text
            self._pills[item.key].show(text, "warn" if item.notable else "calm")
        histogram, dark = status.bus.cycle_us, self._page.dark
        self._summary.set_text(cycle_summary(histogram))
        self._plot.show(
            (histogram, dark),
            lambda: cycle_figure(histogram, self._hello.period_s, dark=dark),
            at_most_every_s=1.0,
        )
