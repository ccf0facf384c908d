"""`hil-sim run` as a process on the embedded bus: boot-up, signals, real time, loss of the bus."""

import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest
from forked_program import ForkedProgram

XY_TABLE = Path(__file__).parents[2] / "machines" / "xy_table"
LIMIT_S = 20.0
NODES = (1, 2, 11, 12)


def ended(process: subprocess.Popen[bytes]) -> tuple[int, str]:
    """Return exit status and remaining output."""
    output, _ = process.communicate(timeout=LIMIT_S)
    return process.returncode, output.decode()


@pytest.mark.usefixtures("hub")
def test_nodes_boot_up_and_answer_a_reset(bench: Any) -> None:
    with bench.monitor() as monitor:
        bench.simulate_by_command(XY_TABLE)
        for node in NODES:
            monitor.wait_for(0x700 + node, b"\0")
        monitor.frames.clear()
        monitor.send(0x000, b"\x81\x00")
        for node in NODES:
            monitor.wait_for(0x700 + node, b"\0")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_signals_end_the_simulator_cleanly(bench: Any, number: signal.Signals) -> None:
    process = bench.simulate_by_command(XY_TABLE)
    started_s = time.monotonic()
    process.send_signal(number)
    status, output = ended(process)
    assert (status, output) == (0, "")
    assert time.monotonic() - started_s < 5.0


@pytest.mark.usefixtures("hub")
def test_real_time_keeps_heartbeats_going_without_sync(bench: Any) -> None:
    with bench.monitor() as monitor:
        bench.simulate_by_command(XY_TABLE, "realtime")
        monitor.send(0x601, bytes.fromhex("2b17100032000000"))  # 1017h = 50 ms
        monitor.wait_for(0x581, bytes.fromhex("6017100000000000"))
        for _ in range(5):
            monitor.frames.clear()
            monitor.wait_for(0x701, b"\x7f")


@pytest.mark.usefixtures("hub")
def test_lockstep_is_silent_without_sync(bench: Any) -> None:
    with bench.monitor() as monitor:
        bench.simulate_by_command(XY_TABLE)
        monitor.send(0x601, bytes.fromhex("2b17100001000000"))  # 1017h = 1 ms
        monitor.wait_for(0x581, bytes.fromhex("6017100000000000"))
        monitor.frames.clear()
        for _ in range(3):
            monitor.send(0x080, b"")
        monitor.send(0x601, bytes.fromhex("4000100000000000"))
        monitor.wait_for(0x581, bytes.fromhex("4300100092010200"))
        assert [frame for frame in monitor.frames if frame[0] == 0x701] == [(0x701, b"\x7f")] * 3


def test_a_lost_bus_ends_the_simulator_with_one_line(bench: Any, hub: ForkedProgram) -> None:
    process = bench.simulate_by_command(XY_TABLE)
    hub.terminate()
    status, output = ended(process)
    assert status == 1
    (line,) = output.splitlines()
    assert line.startswith("hil-sim: bus")
