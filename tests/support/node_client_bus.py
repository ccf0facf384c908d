"""The embedded bus as a client of one node sees it."""

import can

NODE_ID_BITS = 0x7F
"""CiA 301 v4.2.0, 7.3.5: the node of a COB-ID of the predefined connection set."""


def node_client_bus(bus_spec: str, node_id: int) -> can.BusABC:
    """Connect to the bus `localcan:<socket>` for the frames of `node_id` alone.

    In lockstep the others pass at some ten thousand frames a second: more than python-can's notifier reads
    beside other work, so that the node's answers would wait behind them or be lost.
    """
    filters = [{"can_id": node_id, "can_mask": NODE_ID_BITS, "extended": False}]
    return can.Bus(interface="localcan", channel=bus_spec.partition(":")[2], can_filters=filters)
