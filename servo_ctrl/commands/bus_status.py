"""Status of the bus and its nodes; on the local socket only."""

import math
from typing import NamedTuple


class CycleHistogram(NamedTuple):
    """Histogram of the times between cycles, microseconds.

    `counts` has one bin more than `edges_us`: below the first edge, between edges, above the last.
    """

    edges_us: tuple[float, ...] = ()
    counts: tuple[int, ...] = ()


class BusStatus(NamedTuple):
    """The bus and the cycle on it."""

    load: float = 0.0
    """Share of `bit_rate`, 0 to 1, over the last second of SYNC time, with the most possible stuff bits."""
    bit_rate: int = 1_000_000
    """Bit rate in the machine file, bit/s."""
    frames_per_s: float = 0.0
    cycle_us: CycleHistogram = CycleHistogram()
    missed_ticks: int = 0
    missing_inputs: int = 0


class NodeStatus(NamedTuple):
    """State of a node by its heartbeats."""

    name: str
    node_id: int
    nmt_state: str
    """"operational", "pre_operational", "stopped", "booting" or "unknown"."""
    heartbeat_age_s: float = math.nan


class EmcyEntry(NamedTuple):
    """An emergency message."""

    time: str
    """ISO 8601."""
    node: str
    code: int
    error_register: int
    """1001h of the node."""
    text: str


class EventEntry(NamedTuple):
    """An event of the run, in words."""

    cycle: int
    text: str
    time: str = ""
    """When the controller added it to its status, ISO 8601; "" if unknown."""
