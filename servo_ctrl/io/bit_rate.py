"""Check of the machine file's bit rate against that of a SocketCAN interface, by `ip`."""

import json
import subprocess
from collections.abc import Callable
from typing import Any

LIMIT_S = 2.0
"""Bounds the wait for `ip`; chosen."""


def rate_problem(bus: str, stated_kbit_s: int, query: Callable[[str], str] | None = None) -> str:
    """Return why the load of "INTERFACE:CHANNEL" would be wrong; "" if the rate fits or is unknown.

    `query` returns the output of `ip` about a channel.
    """
    interface, _, channel = bus.partition(":")
    if interface != "socketcan":
        return ""
    timing = _timing((query or _ip)(channel))
    rate = timing.get("bittiming", {}).get("bitrate")
    if isinstance(rate, int) and rate and rate != stated_kbit_s * 1000:
        rates = f"{rate / 1e3:g} kbit/s, the machine file says {stated_kbit_s} (bus.bit_rate_kbit_s)"
        return f"bus {bus} runs at {rates}; its load is computed from the file's"
    if "data_bittiming" in timing:
        return f"bus {bus} is set up for CAN FD; the controller sends and receives classic frames only"
    return ""


def _ip(channel: str) -> str:
    """Return the output of `ip` about an interface, JSON; "" without `ip` or output."""
    command = ["ip", "-details", "-json", "link", "show", "dev", channel]
    try:
        return subprocess.run(  # the argument is the name of an interface, and there is no shell
            command, capture_output=True, text=True, timeout=LIMIT_S, check=False
        ).stdout
    except (OSError, subprocess.SubprocessError):
        return ""


def _timing(response: str) -> dict[str, Any]:
    try:
        data = json.loads(response)[0]["linkinfo"]["info_data"]
    except (ValueError, LookupError, TypeError):
        return {}
    return data if isinstance(data, dict) else {}
