"""The Bus page: load, cycle times, nodes, emergency messages, and the objects of the nodes."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from nicegui import ui

from servo_ctrl.commands.bus_status import BusStatus, CycleHistogram, EmcyEntry, NodeStatus
from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.bus.object_browser import ObjectBrowser
from servo_ctrl.hmi.languages.texts import tr, translated, word
from servo_ctrl.hmi.shell.live_content import Plot, TextTable, when_connected
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import CHECK, WARNING, Pill, button, card, div, faint
from servo_ctrl.hmi.shell.plots import Theme, figure, plot_layout
from servo_ctrl.hmi.shell.units import grouped

TITLE = word("Bus")
LATE_HEARTBEAT_S = 2.0
"""Age of a heartbeat that is marked; the controller's own bound, which stops the machine, is shorter."""
HIGH_LOAD = 0.8
"""Bus load from which it is marked; chosen: the rest hardly suffices for SDO transfers and disturbances."""
NMT_STATES = {
    "operational": word("operational"),
    "pre_operational": word("pre-operational"),
    "stopped": word("stopped"),
    "booting": word("booting"),
    "unknown": word("no heartbeat yet"),
}
ERROR_REGISTER = (
    word("generic"),
    word("current"),
    word("voltage"),
    word("temperature"),
    word("communication"),
    word("device profile"),
    word("reserved"),
    word("manufacturer"),
)
"""Bits of object 1001h (CiA 301), from the lowest."""
EMCY_HEAD = (word("time"), word("node"), word("code"), word("error register"), word("meaning"))
NODE_HEAD = (word("node"), word("number"), word("state"), word("heartbeat"))


def build(page: OpenPage) -> None:
    """Build the content of the page."""

    def make(hello: Hello) -> Sequence[Callable[[MachineStatus], None]]:
        traffic = TrafficCards(page, hello)
        with div("bench-wide"):
            with card(tr("Emergency messages"), "emcy"):
                emcy = TextTable("emcy-table", translated(EMCY_HEAD))
                no_emcy = faint(tr("None since the start.")).mark("emcy-none")
            with card(tr("Nodes"), "nodes"):
                nodes = TextTable("node-table", translated(NODE_HEAD))
        ObjectBrowser(page, hello)

        def refresh(status: MachineStatus) -> None:
            nodes.show(node_rows(status.nodes))
            emcy.show(emcy_rows(status.emcy))
            no_emcy.set_visibility(not status.emcy)

        return traffic.refresh, refresh

    when_connected(page, make)


LOCKSTEP = word("In lockstep a cycle takes as long as the computers need: none of these times is late.")


class TrafficCards:
    """The load of the bus and the regularity of the cycle."""

    def __init__(self, page: OpenPage, hello: Hello) -> None:
        self._page, self._hello = page, hello
        self._pills: dict[str, Pill] = {}
        with div("bench-wide"):
            with card(tr("Cycle time"), "cycle"):
                self._plot = Plot("cycle-plot", tr("Histogram of the cycle time"), 260)
                self._summary = ui.label().classes("num").mark("cycle-summary")
                if hello.lockstep:
                    faint(tr(LOCKSTEP)).mark("cycle-lockstep")
            with card(tr("Traffic"), "traffic"):
                self._place = div("bench-column")
                button(tr("Clear counters"), lambda: page.ask("clear_counters"), "clear-counters")

    def refresh(self, status: MachineStatus) -> None:
        """Show the figures of the bus."""
        for item in traffic_figures(status.bus):
            if item.key not in self._pills:
                with self._place, div("bench-row apart"):
                    ui.label(item.name)
                    self._pills[item.key] = Pill(item.key)
            text = f"{WARNING} {item.text}" if item.notable else item.text
            self._pills[item.key].show(text, "warn" if item.notable else "calm")
        histogram, theme = status.bus.cycle_us, self._page.look.theme
        self._summary.set_text(cycle_summary(histogram))
        self._plot.show(
            (histogram, theme),
            lambda: cycle_figure(histogram, None if self._hello.lockstep else self._hello.period_s, theme),
            at_most_every_s=1.0,
        )


class TrafficFigure(NamedTuple):
    """A figure of the bus with its name."""

    key: str
    name: str
    text: str
    notable: bool = False
    """Somebody should look at it."""


def traffic_figures(bus: BusStatus) -> list[TrafficFigure]:
    """Load, frames, missed ticks and missing inputs."""
    name = tr(
        "load of {rate:g} Mbit/s, fine up to {most:.0f} %", rate=bus.bit_rate / 1e6, most=100.0 * HIGH_LOAD
    )
    load = name, f"{100.0 * bus.load:.1f} %"
    return [
        TrafficFigure("load", *load, bus.load > HIGH_LOAD),
        TrafficFigure("frames", tr("frames a second"), grouped(bus.frames_per_s)),
        TrafficFigure("missed-ticks", tr("missed ticks"), str(bus.missed_ticks), bus.missed_ticks > 0),
        TrafficFigure(
            "missing-inputs", tr("missing inputs"), str(bus.missing_inputs), bus.missing_inputs > 0
        ),
    ]


def cycle_figure(histogram: CycleHistogram, period_s: float | None, theme: Theme) -> dict[str, Any]:
    """Return the histogram of the cycle time with logarithmic counts: the rare cycles matter.

    `period_s`: the nominal time of a cycle; None in lockstep, which has none.
    """
    counts = histogram.counts
    bars = {
        "type": "bar",
        "x": bin_names(histogram.edges_us),
        "y": [count or None for count in counts],
        "marker": {"color": theme.curve(0)},
        "hovertemplate": "%{x} µs: %{y}<extra></extra>",
    }
    title = tr("cycle time (µs)")
    if period_s is not None:
        title = tr("cycle time (µs), nominal {nominal:g}", nominal=period_s * 1e6)
    layout = plot_layout(title, tr("cycles"), theme)
    layout |= {"showlegend": False, "bargap": 0.05}
    # from below 1, so that a single late cycle has a bar
    layout["yaxis"] |= {"type": "log", "dtick": 1, "range": [-0.3, math.log10(max(*counts, 10)) + 0.1]}
    layout["xaxis"] |= {"type": "category"}
    return figure([bars], layout, revision="cycle")


def bin_names(edges_us: Sequence[float]) -> list[str]:
    """Return the names of the bins: below the first edge, between two edges, from the last edge on."""
    if not edges_us:
        return [tr("all")]
    between = [f"{low:g}\N{EN DASH}{high:g}" for low, high in pairwise(edges_us)]
    return [f"< {edges_us[0]:g}", *between, f"≥ {edges_us[-1]:g}"]


def cycle_summary(histogram: CycleHistogram) -> str:
    """Return the number of cycles, the most frequent bin and the slowest one, in a sentence."""
    total = sum(histogram.counts)
    if not total:
        return tr("No cycle was timed yet.")
    names = bin_names(histogram.edges_us)
    most = max(range(len(names)), key=lambda place: histogram.counts[place])
    slowest = max(place for place, count in enumerate(histogram.counts) if count)
    percent = 100.0 * histogram.counts[most] / total
    return tr(
        "{total} cycles; {percent:.3g} % took {most} µs; the slowest {count} took {slowest} µs.",
        total=total,
        percent=percent,
        most=names[most],
        count=histogram.counts[slowest],
        slowest=names[slowest],
    )


def node_rows(nodes: Sequence[NodeStatus]) -> list[tuple[str, str, str, str]]:
    """Return name, node id, NMT state and age of the heartbeat of each node; faults have a warning sign."""
    rows = []
    for node in nodes:
        age_s = node.heartbeat_age_s
        heartbeat = tr("none received") if math.isnan(age_s) else tr("{age_s:.2f} s ago", age_s=age_s)
        notable = node.nmt_state != "operational" or age_s > LATE_HEARTBEAT_S
        state = tr(NMT_STATES.get(node.nmt_state, node.nmt_state))
        rows.append((node.name, str(node.node_id), f"{WARNING if notable else CHECK} {state}", heartbeat))
    return rows


def emcy_rows(entries: Sequence[EmcyEntry]) -> list[tuple[str, str, str, str, str]]:
    """Return time, node, code, error register and text of the emergency messages, the newest first."""
    return [
        (
            entry.time.replace("T", " ")[:23],
            entry.node,
            f"{entry.code:04X}h",
            register_text(entry.error_register),
            entry.text,
        )
        for entry in reversed(entries)
    ]


def register_text(register: int) -> str:
    """Return the set bits of the error register in words."""
    return ", ".join(tr(bit) for place, bit in enumerate(ERROR_REGISTER) if register >> place & 1) or tr(
        "no error"
    )
