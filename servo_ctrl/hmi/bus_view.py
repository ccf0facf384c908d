"""What the Bus page shows, as plain values."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from servo_ctrl.hmi.palette import lines
from servo_ctrl.hmi.plot_frame import figure_of, layout_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from servo_ctrl.config.local_status import BusState, EmcyEntry, Histogram, NodeState

LATE_S = 2.0
"""Age of a heartbeat beyond which a person should look, seconds; the machine has its own, shorter bound."""
FULL = 0.8
"""Load of the bus beyond which little is left for SDO and disturbances."""
NMT = {
    "operational": "operational",
    "pre_operational": "pre-operational",
    "stopped": "stopped",
    "booting": "booting",
    "unknown": "not heard yet",
}
REGISTER = (
    "generic",
    "current",
    "voltage",
    "temperature",
    "communication",
    "device profile",
    "reserved",
    "manufacturer",
)
"""Bits of the error register 1001h (CiA 301)."""


class Figure(NamedTuple):
    """A number with its name."""

    key: str
    name: str
    text: str
    worth_a_look: bool


class NodeRow(NamedTuple):
    """A node, ready to be shown."""

    name: str
    node_id: int
    state: str
    heartbeat: str
    worth_a_look: bool


class EmcyRow(NamedTuple):
    """An emergency message, ready to be shown."""

    time: str
    node: str
    code: str
    register: str
    text: str


def figures(bus: BusState) -> list[Figure]:
    """Load, frames and what was missed."""
    return [
        Figure(
            "load", f"load of {bus.bit_rate / 1e6:g} Mbit/s", f"{100.0 * bus.load:.1f} %", bus.load > FULL
        ),
        Figure("frames", "frames a second", f"{bus.frames_per_s:,.0f}".replace(",", " "), worth_a_look=False),
        Figure("missed-ticks", "missed ticks", str(bus.missed_ticks), bus.missed_ticks > 0),
        Figure("missing-inputs", "missing inputs", str(bus.missing_inputs), bus.missing_inputs > 0),
    ]


def cycle_figure(histogram: Histogram, period_s: float, *, dark: bool) -> dict[str, Any]:
    """How often a cycle took how long, counts on a logarithmic axis: what matters is rare."""
    counts = histogram.counts
    data = [
        {
            "type": "bar",
            "x": bin_names(histogram.edges_us),
            "y": [count or None for count in counts],
            "marker": {"color": lines(dark=dark)[0]},
            "hovertemplate": "%{x} µs: %{y}<extra></extra>",
        }
    ]
    layout = layout_of(f"cycle time (µs), nominal {period_s * 1e6:g}", "cycles", dark=dark)
    layout["showlegend"] = False
    # from below 1: a single late cycle is what one looks for
    layout["yaxis"] |= {"type": "log", "dtick": 1, "range": [-0.3, math.log10(max(*counts, 10)) + 0.1]}
    layout["xaxis"] |= {"type": "category"}
    layout["bargap"] = 0.05
    return figure_of(data, layout, revision="cycle")


def bin_names(edges_us: Sequence[float]) -> list[str]:
    """Of the bins: below the first edge, between two, above the last."""
    if not edges_us:
        return ["all"]
    between = [f"{low:g}\N{EN DASH}{high:g}" for low, high in pairwise(edges_us)]
    return [f"< {edges_us[0]:g}", *between, f"≥ {edges_us[-1]:g}"]


def cycle_summary(histogram: Histogram) -> str:
    """How many cycles there were, and where most and the slowest of them lie."""
    total = sum(histogram.counts)
    if not total:
        return "No cycle was timed yet."
    names = bin_names(histogram.edges_us)
    most = max(range(len(names)), key=lambda place: histogram.counts[place])
    slowest = max(place for place, count in enumerate(histogram.counts) if count)
    share = 100.0 * histogram.counts[most] / total
    return (
        f"{total} cycles; {share:.3g} % took {names[most]} µs; the slowest {histogram.counts[slowest]} "
        f"took {names[slowest]} µs."
    )


def node_rows(nodes: Sequence[NodeState]) -> list[NodeRow]:
    """Each node with its state and the age of its heartbeat."""
    rows = []
    for node in nodes:
        age_s = node.heartbeat_age_s
        heartbeat = "none heard" if age_s is None else f"{age_s:.2f} s ago"
        odd = node.nmt_state != "operational" or (age_s is not None and age_s > LATE_S)
        rows.append(NodeRow(node.name, node.node_id, NMT.get(node.nmt_state, node.nmt_state), heartbeat, odd))
    return rows


def emcy_rows(entries: Sequence[EmcyEntry]) -> list[EmcyRow]:
    """The emergency messages, the newest first."""
    return [
        EmcyRow(
            entry.time.replace("T", " ")[:23],
            entry.node,
            f"{entry.code:04X}h",
            register_text(entry.error_register),
            entry.text,
        )
        for entry in reversed(entries)
    ]


def register_text(register: int) -> str:
    """The error register in words."""
    return ", ".join(word for bit, word in enumerate(REGISTER) if register >> bit & 1) or "no error"
