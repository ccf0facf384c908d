"""Status of the bus and its nodes; on the local socket only."""

import math
from typing import NamedTuple


class CycleHistogram(NamedTuple):
    """Cycles by the time since the one before, microseconds.

    `counts` has one more than `edges_us`: below the first, between, above the last.
    """

    edges_us: tuple[float, ...] = ()
    counts: tuple[int, ...] = ()


class BusStatus(NamedTuple):
    """The bus and the cycle on it."""

    load: float = 0.0
    """Share of `bit_rate`, 0 to 1, over the last second of SYNC time; stuff bits as many as may be."""
    bit_rate: int = 1_000_000
    """Of the machine file, bit/s."""
    frames_per_s: float = 0.0
    cycle_us: CycleHistogram = CycleHistogram()
    missed_ticks: int = 0
    missing_inputs: int = 0


class NodeStatus(NamedTuple):
    """A node, by its heartbeats."""

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
    """When the controller put it into its status, ISO 8601; "" where it was not told."""
