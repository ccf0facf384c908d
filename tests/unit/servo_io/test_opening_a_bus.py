"""A bus that is absent or fails is a one-line error with advice."""

import asyncio
import errno

import can
import pytest

from servo_ctrl.io.can_port import BusError, open_port
from servo_ctrl.io.error_frames import BusNews, describe_error_frame


@pytest.mark.parametrize(
    ("error_class", "payload", "lost", "down", "text"),
    [
        (0x040, b"", True, True, "bus-off"),
        (0x044, b"\x00\x20", True, True, "bus-off"),
        (0x004, b"\x00\x02", True, False, "transmit overrun: frames were lost"),
        (0x004, b"\x00\x10", False, False, "error passive"),
        (0x004, b"\x00\x08", False, False, "error warning"),
        (0x100, b"", False, False, "controller restarted"),
        (0x004, b"\x00\x40", False, False, "back to error active"),
        (0x020, b"", False, False, "no acknowledge on transmission"),
        (0x200, b"", False, False, "error frame of class 0x200"),
    ],
)
def test_error_frames_in_words(error_class: int, payload: bytes, lost: bool, down: bool, text: str) -> None:
    restarted = error_class == 0x100 or payload == b"\x00\x40"
    assert describe_error_frame(error_class, payload) == BusNews(text, lost, down, restarted)


@pytest.mark.parametrize(
    ("spec", "complaint"),
    [
        ("vcan0", "must be INTERFACE:CHANNEL"),
        ("socketcan:", "must be INTERFACE:CHANNEL"),
        (":vcan0", "must be INTERFACE:CHANNEL"),
        ("nosuch:vcan0", "cannot be opened: Unknown interface type"),
        ("localcan:/no/such/hub.sock", "cannot be opened: no hub at /no/such/hub.sock"),
        ("socketcan:nosuchcan9", "cannot be opened: "),
    ],
)
def test_missing_bus_is_a_one_line_error(spec: str, complaint: str) -> None:
    with pytest.raises(BusError, match=complaint) as caught:
        open_port(spec)
    assert "\n" not in str(caught.value)


async def test_port_with_one_identifier_receives_no_other() -> None:
    received: list[int] = []
    port = open_port("virtual:filtered", only=(0x5FF,))
    with can.Bus(interface="virtual", channel="filtered") as other:
        for can_id in (0x080, 0x181, 0x5FF, 0x701):
            other.send(can.Message(arbitration_id=can_id, is_extended_id=False))
        port.fallback = lambda can_id, _data, _timestamp_s: received.append(can_id)
        for _ in range(4):
            port._drain()
    port.close()
    assert received == [0x5FF]


async def test_interface_without_a_file_descriptor_is_refused() -> None:
    port = open_port("virtual:portless")
    try:
        with pytest.raises(BusError, match="no file to wait on"):
            port.attach(asyncio.get_running_loop())
    finally:
        port.close()


def test_without_socketcan_the_error_advises_the_embedded_bus(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**_: object) -> None:
        raise OSError(errno.EAFNOSUPPORT, "Address family not supported by protocol")

    monkeypatch.setattr(can, "Bus", refuse)
    with pytest.raises(BusError, match=r"has no SocketCAN; use localcan:SOCKET, which `hil-sim run"):
        open_port("socketcan:vcan0")
