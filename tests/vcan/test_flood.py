"""A flood of frames that nobody uses, and a queue that overflows, on the kernel's CAN."""

import asyncio
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import can
import pytest

from servo_ctrl.io.can_port import open_port
from servo_ctrl.io.error_frames import BusNews

pytestmark = pytest.mark.vcan

ROOT = Path(__file__).resolve().parents[2]
VCAN = "socketcan:vcan0"
UNUSED, INPUTS = 0x6F0, 0x181
FLOOD = 30_000
"""The least of them; they go on until the run ends."""
RUN_TIMEOUT_S = 900.0
PROGRAM = """
[[step]]
kind = "move"
to_mm = { x = 5.0, y = 0.0 }
feed_mm_min = 3000.0
"""


def test_a_run_ends_well_under_a_flood_of_an_unused_identifier(
    start_simulator: Callable[[str], object], tmp_path: Path
) -> None:
    """From boot to the end, as fast as the kernel takes the frames."""
    start_simulator(VCAN)
    program = tmp_path / "program.toml"
    program.write_text(PROGRAM, encoding="utf-8")
    command = [str(Path(sys.executable).with_name("servo-ctrl")), "run", "--machine", "machines/xy_table"]
    command += ["--program", str(program), "--pacing", "lockstep", "--bus", VCAN]
    unused = can.Message(arbitration_id=UNUSED, data=bytes(8), is_extended_id=False)
    sent = 0
    with (
        subprocess.Popen(
            command, cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        ) as run,
        can.Bus(interface="socketcan", channel="vcan0") as station,
    ):
        while run.poll() is None:
            station.send(unused, 10.0)
            sent += 1
        assert run.stdout is not None
        said = run.stdout.read()
    assert run.returncode == 0, said
    assert "lost" not in said
    assert sent > FLOOD


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
        with can.Bus(interface="socketcan", channel="vcan0") as station:
            message = can.Message(arbitration_id=INPUTS, data=bytes(8), is_extended_id=False)
            for _ in range(5000):
                station.send(message, 10.0)
            port.attach(asyncio.get_running_loop())
            await port.caught_up()
            assert 0 < received < 5000
            assert news.empty()
            station.send(message, 10.0)
            reported = await asyncio.wait_for(news.get(), 60.0)
    finally:
        port.close()
    assert reported == BusNews("receive overrun: frames were lost", frames_lost=True, down=False)
