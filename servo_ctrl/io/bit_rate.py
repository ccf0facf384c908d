"""The bit rate of a SocketCAN interface, as `ip` tells it: what the machine file says is held against it."""

import json
import subprocess
from collections.abc import Callable
from typing import Any

LIMIT_S = 2.0
"""Bounds the wait for `ip`; chosen."""


def rate_problem(bus: str, stated_kbit_s: int, ask: Callable[[str], str] | None = None) -> str:
    """Why the load of "INTERFACE:CHANNEL" would be computed wrongly; "" where all is well or nobody knows."""
    interface, _, channel = bus.partition(":")
    if interface != "socketcan":
        return ""
    found = _timing((ask or _ip)(channel))
    rate = found.get("bittiming", {}).get("bitrate")
    if isinstance(rate, int) and rate and rate != stated_kbit_s * 1000:
        told = f"{rate / 1e3:g} kbit/s, the machine file says {stated_kbit_s} (bus.bit_rate_kbit_s)"
        return f"bus {bus} runs at {told}; its load is computed from the file's"
    if "data_bittiming" in found:
        return f"bus {bus} is set up for CAN FD; the controller sends and takes classic frames alone"
    return ""


def _ip(channel: str) -> str:
    """What `ip` knows of an interface, as JSON; "" where there is no `ip` or no answer."""
    command = ["ip", "-details", "-json", "link", "show", "dev", channel]
    try:
        return subprocess.run(  # the name of an interface, no shell
            command, capture_output=True, text=True, timeout=LIMIT_S, check=False
        ).stdout
    except (OSError, subprocess.SubprocessError):
        return ""


def _timing(answer: str) -> dict[str, Any]:
    try:
        data = json.loads(answer)[0]["linkinfo"]["info_data"]
    except (ValueError, LookupError, TypeError):
        return {}
    return data if isinstance(data, dict) else {}
