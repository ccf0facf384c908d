"""Daemon and simulator run a circle in lockstep on vcan0: the same bits as on localcan, and clean CANopen."""

import json
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can
import pytest
from forked_program import commands_folder
from pyarrow import parquet

pytestmark = pytest.mark.vcan

ROOT = Path(__file__).resolve().parents[2]
RUN_TIMEOUT_S = 900.0
PROGRAM = """
[[step]]
kind = "move"
to_mm = { x = 2.0, y = 0.0 }
feed_mm_min = 6000.0

[[step]]
kind = "circle"
label = "F 2000"
radius_mm = 2.0
feed_mm_min = 2000.0
turns = 3.1
ramp_s = 0.1
"""
OTHER_NODE = can.Message(arbitration_id=0x777, is_extended_id=False, data=b"\x7f")


@dataclass
class Candump:
    """`candump -L` into a file."""

    process: subprocess.Popen[bytes]
    log: Path

    def finish(self) -> None:
        """Stop it once it has written down all that was sent."""
        size = -1
        while size != self.log.stat().st_size:
            size = self.log.stat().st_size
            time.sleep(0.5)
        self.process.terminate()
        self.process.wait(60.0)


@pytest.fixture
def candump(tmp_path: Path) -> Iterator[Candump | None]:
    if shutil.which("candump") is None or shutil.which("tshark") is None:
        yield None
        return
    log = tmp_path / "candump.log"
    with (
        log.open("wb") as file,
        subprocess.Popen(["candump", "-L", "-r", "16777216", "vcan0"], stdout=file) as process,
        can.Bus(interface="socketcan", channel="vcan0") as sender,
    ):
        while not log.stat().st_size:  # candump says nothing when it is ready
            assert process.poll() is None
            sender.send(OTHER_NODE)
        yield Candump(process, log)
        process.terminate()


def run_circle(bus_spec: str, directory: Path) -> tuple[dict[str, bytes], dict[str, Any]]:
    """Bytes of each recorded column, and what the recording says of itself without its date."""
    program = directory.with_name("circle.toml")
    program.write_text(PROGRAM)
    options = ["--machine", "machines/xy_table", "--program", str(program), "--pacing", "lockstep"]
    subprocess.run(
        [commands_folder() / "servo-ctrl", "run", *options, "--bus", bus_spec, "--record", str(directory)],
        cwd=ROOT,
        check=True,
        timeout=RUN_TIMEOUT_S,
    )
    table = parquet.ParquetDataset(sorted(directory.glob("part-*.parquet"))).read()
    columns = {name: table[name].to_numpy().tobytes() for name in table.column_names}
    header = json.loads((directory / "recording.json").read_text())
    del header["started"]
    return columns, header


def test_the_recording_is_that_of_localcan_bit_for_bit(
    localcan: str, start_simulator: Callable[[str], object], candump: Candump | None, tmp_path: Path
) -> None:
    start_simulator(localcan)
    start_simulator("socketcan:vcan0")
    on_localcan, local_header = run_circle(localcan, tmp_path / "localcan")
    on_vcan, header = run_circle("socketcan:vcan0", tmp_path / "vcan")
    assert list(on_vcan) == list(on_localcan)
    assert [name for name in on_vcan if on_vcan[name] != on_localcan[name]] == []
    assert header == local_header
    if candump is None:
        pytest.skip("the bits are equal; the frames are not looked at, as candump or tshark is missing")
    candump.finish()
    assert_clean_canopen(candump.log)


def assert_clean_canopen(log: Path) -> None:
    """Every frame of a candump log is CANopen to tshark, and none is malformed."""
    frames = log.read_text().count("\n")
    assert frames > 7 * 1000  # a second of SYNC, two RPDO and four TPDO
    assert log.read_text().count(" 080#") > 1000

    def tshark(*display_filter: str) -> list[str]:
        command = ["tshark", "-r", str(log), "-d", "can.subdissector,canopen", *display_filter]
        result = subprocess.run(command, capture_output=True, text=True, check=True, timeout=RUN_TIMEOUT_S)
        return result.stdout.splitlines()

    assert len(tshark("-Y", "canopen")) == frames
    assert tshark("-Y", "_ws.malformed") == []
