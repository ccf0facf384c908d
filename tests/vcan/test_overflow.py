"""A queue that overflows on the kernel's CAN is reported."""

import asyncio

import can
import pytest

from servo_ctrl.io.can_port import open_port
from servo_ctrl.io.error_frames import BusNews

pytestmark = pytest.mark.vcan

VCAN = "socketcan:vcan0"
INPUTS = 0x181


async def test_frames_that_a_port_has_no_room_for_are_reported() -> None:
    news: asyncio.Queue[BusNews] = asyncio.Queue()
    port = open_port(VCAN)
    received = 0

    def count(_payload: bytearray, _time_s: float) -> None:
        nonlocal received
        received += 1

    port.handlers[INPUTS] = count
    port.on_error_frame = news.put_nowait
    try:
        with can.Bus(interface="socketcan", channel="vcan0", receive_own_messages=True) as station:
            message = can.Message(arbitration_id=INPUTS, data=bytes(8), is_extended_id=False)
            for _ in range(5000):
                station.send(message, 10.0)
                assert station.recv(10.0), "else a busy kernel drops it before the queue of any socket"
            port.attach(asyncio.get_running_loop())
            await port.caught_up()
            assert 0 < received < 5000
            assert news.empty()
            async with asyncio.timeout(60.0):
                while news.empty():  # where reading was not done, its queue is full still
                    station.send(message, 10.0)
                    await port.caught_up()
            reported = news.get_nowait()
    finally:
        port.close()
    assert reported == BusNews("receive overrun: frames were lost", frames_lost=True, down=False)
