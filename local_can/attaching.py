"""Attaches to the bus: to the hub of another process, or to a hub in this process."""

import socket
import time
from pathlib import Path

from local_can import wire
from local_can.listening import HubError, HubPresentError
from local_can.served_hub import ServedHub

ATTACH_TIMEOUT_S = 5.0
"""Bounds the wait for a hub's answer (chosen)."""
_CONNECT_AGAIN_S = 0.01
"""Pause before another try while the hub's connection queue is full (chosen)."""


class AttachError(Exception):
    """No hub attached this client; the message gives reason and remedy."""


def _connect(client: socket.socket, channel: str, deadline_s: float) -> None:
    """Connect, with retries while the hub's connection queue is full."""
    while True:
        try:
            client.connect(channel)
        except BlockingIOError:
            if time.monotonic() > deadline_s:
                raise TimeoutError from None
            time.sleep(_CONNECT_AGAIN_S)
        else:
            return


def served_here(channel: str, packets: tuple[bytes, ...]) -> ServedHub | None:
    """Return a hub at `channel` in this process; None if another hub serves it already."""
    try:
        return ServedHub(Path(channel), packets)
    except HubPresentError:
        return None
    except HubError as error:
        raise AttachError(str(error)) from error


def attached(channel: str, packets: tuple[bytes, ...], timeout_s: float) -> socket.socket:
    """Send the request `packets` to the hub at `channel`; return the attached, non-blocking socket."""
    client = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    client.settimeout(timeout_s)
    try:
        _connect(client, channel, time.monotonic() + timeout_s)
        for packet in packets:
            client.send(packet)
        if client.recv(1) != wire.ATTACHED:
            raise ConnectionResetError(None, "it closed the connection")
    except TimeoutError:
        client.close()
        raise AttachError(f"the hub at {channel} does not answer within {timeout_s:g} s") from None
    except OSError as error:
        client.close()
        advice = f"a simulator serves one, or: python -m local_can {channel}"
        raise AttachError(f"no hub at {channel} ({error.strerror or error}); {advice}") from error
    client.setblocking(False)
    return client
