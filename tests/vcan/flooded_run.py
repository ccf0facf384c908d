"""A run under a flood of frames that nobody uses, on the kernel's CAN; run by `make conformance`."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import can
import pytest

pytestmark = pytest.mark.vcan

ROOT = Path(__file__).resolve().parents[2]
VCAN = "socketcan:vcan0"
UNUSED = 0x6F0
BURST = 20
"""Unused frames behind each look at the bus: more than a bus of 1 Mbit/s has room for beside the cycle's."""
FLOOD = 400
"""The least of them in a run."""
PROGRAM = """
[[step]]
kind = "move"
to_mm = { x = 5.0, y = 0.0 }
feed_mm_min = 3000.0
"""


def test_a_run_ends_well_under_a_flood_of_an_unused_identifier(
    start_simulator: Callable[[str], object], tmp_path: Path
) -> None:
    """From boot to the end, a burst whenever the others have sent something."""
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
            if station.recv(0.1) is None:
                continue
            while station.recv(0.0) is not None:
                pass  # one burst for all that has come: a slow computer is not flooded at one go
            for _ in range(BURST):
                station.send(unused, 10.0)
            sent += BURST
        assert run.stdout is not None
        printed = run.stdout.read()
    assert run.returncode == 0, printed
    assert "lost" not in printed
    assert sent > FLOOD
