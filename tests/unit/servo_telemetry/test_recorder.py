"""Recordings: whole, torn off by a real kill -9, on a disk that does not play along, and as CSV."""

import csv
import json
import math
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from servo_ctrl.files.arrow import write_csv
from servo_ctrl.recording import recorder as recorder_module
from servo_ctrl.recording.channels import AXIS_CHANNELS, MACHINE_CHANNELS, channels_of
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.recording.recorder import CHUNKS, Recorder, RecordingError

CHANNELS = channels_of(["x"])
HEADER: dict[str, Any] = {"axes": ["x"], "segments": [{"label": "circle"}], "finished": False}


def row(cycle: int) -> list[float]:
    return [
        cycle * 0.001,
        cycle,
        cycle % 2 - 1,
        *(cycle + 0.25 * i for i in range(len(AXIS_CHANNELS) - 1)),
        0x1637,
    ]


@pytest.fixture(autouse=True)
def no_writer_is_left() -> Iterator[None]:
    yield
    assert "recorder" not in {thread.name for thread in threading.enumerate()}


def test_rows_come_back_in_order_and_type(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "r", CHANNELS, HEADER, rows_per_part=10, wait_s=5.0)
    for cycle in range(25):
        recorder.record(row(cycle))
    recorder.close(HEADER | {"finished": True})
    loaded = load_recording(tmp_path / "r")
    assert [path.name for path in sorted((tmp_path / "r").glob("part*"))] == [
        "part-00000.parquet",
        "part-00001.parquet",
        "part-00002.parquet",
    ]
    assert list(loaded.columns) == [channel.name for channel in CHANNELS]
    for place, channel in enumerate(CHANNELS):
        column = loaded.columns[channel.name]
        assert column.dtype == np.dtype(channel.dtype)
        assert column.tolist() == [row(cycle)[place] for cycle in range(25)]
    assert loaded.header["finished"] is True
    assert loaded.segment("circle")["cycle"].tolist() == list(range(1, 25, 2))


def test_missing_values_stay_missing(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "r", CHANNELS, HEADER)
    values = row(0)
    values[3] = math.nan
    recorder.record(values)
    recorder.close(HEADER)
    assert math.isnan(load_recording(tmp_path / "r").columns["x.position_command_m"][0])


KILLED = """
import sys
from pathlib import Path
from servo_ctrl.recording.channels import channels_of
from servo_ctrl.recording.recorder import Recorder
header = {"axes": ["x"], "segments": []}
recorder = Recorder(Path(sys.argv[1]), channels_of(["x"]), header, rows_per_part=50, wait_s=5.0)
cycle = 0
while True:
    recorder.record([cycle * 0.001, cycle, -1, *[float(cycle)] * 11, 1])
    cycle += 1
    if cycle == 1000:
        print("going on", flush=True)
"""


def test_recording_is_readable_after_kill_9(tmp_path: Path) -> None:
    directory = tmp_path / "r"
    with subprocess.Popen([sys.executable, "-c", KILLED, str(directory)], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"going on\n"
        process.send_signal(signal.SIGKILL)
        assert process.wait(timeout=10.0) == -signal.SIGKILL
    cycles = load_recording(directory).columns["cycle"]
    # a thousand rows were recorded; what the queue held is lost, what was written is whole
    assert len(cycles) >= 1000 - 50 * CHUNKS
    assert len(cycles) % 50 == 0
    assert cycles.tolist() == list(range(len(cycles)))


def test_incomplete_part_is_ignored(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "r", CHANNELS, HEADER)
    recorder.record(row(0))
    recorder.close(HEADER)
    (tmp_path / "r" / "part-00001.parquet.tmp").write_bytes(b"PAR1 half of it")
    assert len(load_recording(tmp_path / "r").columns["cycle"]) == 1


def test_disk_that_is_full_is_reported_and_what_was_written_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = recorder_module.write_part

    def full_from_the_second_part(path: Path, *rest: Any) -> None:
        if path.name != "part-00000.parquet":
            raise OSError(28, "No space left on device")
        written(path, *rest)

    monkeypatch.setattr(recorder_module, "write_part", full_from_the_second_part)
    recorder = Recorder(tmp_path / "r", CHANNELS, HEADER, rows_per_part=10, wait_s=5.0)
    for cycle in range(35):
        recorder.record(row(cycle))
    with pytest.raises(RecordingError, match=r"cannot be written: No space left on device \(25 rows lost\)"):
        recorder.close(HEADER)
    loaded = load_recording(tmp_path / "r")
    assert len(loaded.columns["cycle"]) == 10
    assert loaded.header["loss"] == "cannot be written: No space left on device (25 rows lost)"


def test_complete_recording_reports_no_loss(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "r", CHANNELS, HEADER)
    recorder.record(row(0))
    recorder.close(HEADER)
    assert "loss" not in load_recording(tmp_path / "r").header


def test_stalled_disk_loses_rows_in_real_time_and_reports_how_many(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stall = threading.Event()
    written = recorder_module.write_part

    def stalled(*arguments: Any) -> None:
        assert stall.wait(10.0)
        written(*arguments)

    monkeypatch.setattr(recorder_module, "write_part", stalled)
    recorder = Recorder(tmp_path / "r", CHANNELS, HEADER, rows_per_part=10)
    for cycle in range(10 * CHUNKS + 7):
        recorder.record(row(cycle))
    stall.set()
    with pytest.raises(RecordingError, match="the disk was too slow, 7 rows lost"):
        recorder.close(HEADER)
    assert len(load_recording(tmp_path / "r").columns["cycle"]) == 10 * CHUNKS


def test_hanging_disk_delays_lockstep_only_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stall, waits = threading.Event(), []
    monkeypatch.setattr(recorder_module, "write_part", lambda *_: stall.wait(10.0))
    recorder = Recorder(tmp_path / "r", CHANNELS, HEADER, rows_per_part=10, wait_s=0.05)
    for cycle in range(10 * CHUNKS + 20):
        started_s = time.perf_counter()
        recorder.record(row(cycle))
        waits.append(time.perf_counter() - started_s)
    stall.set()
    with pytest.raises(RecordingError, match="20 rows lost"):
        recorder.close(HEADER)
    assert sum(wait >= 0.05 for wait in waits[10 * CHUNKS :]) == 1


def test_failing_writer_is_reported_and_blocks_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stumble(*_: Any) -> None:
        raise TypeError("a bug")

    monkeypatch.setattr(recorder_module, "write_part", stumble)
    recorder = Recorder(tmp_path / "r", CHANNELS, HEADER, rows_per_part=10, wait_s=5.0)
    for cycle in range(20 * CHUNKS):
        recorder.record(row(cycle))
    with pytest.raises(RecordingError, match=r"TypeError\('a bug'\) \(160 rows lost\)"):
        recorder.close(HEADER)


def test_unwritable_directory_is_refused_at_the_start(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(RecordingError, match=r"file/r: cannot be written: Not a directory"):
        Recorder(tmp_path / "file" / "r", CHANNELS, HEADER)


def test_recording_is_never_written_over(tmp_path: Path) -> None:
    Recorder(tmp_path / "r", CHANNELS, HEADER).close(HEADER)
    with pytest.raises(RecordingError, match="holds a recording already"):
        Recorder(tmp_path / "r", CHANNELS, HEADER)


def test_csv_has_the_same_numbers(tmp_path: Path) -> None:
    columns = {"time_s": np.array([0.0, 0.001]), "x.position_command_m": np.array([math.nan, 1 / 3])}
    write_csv(tmp_path / "out.csv", columns)
    with (tmp_path / "out.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["time_s", "x.position_command_m"]
    assert math.isnan(float(rows[1][1]))
    assert float(rows[2][1]) == 1 / 3


def test_header_is_replaced_atomically(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "r", CHANNELS, HEADER)
    recorder.update_header(HEADER | {"note": "x" * 10_000})
    recorder.record(row(0))
    recorder.close(HEADER | {"finished": True})
    assert json.loads((tmp_path / "r" / "recording.json").read_text())["finished"] is True
    assert list((tmp_path / "r").glob("*.tmp")) == []


def test_document_lists_exactly_the_channels() -> None:
    text = (Path(__file__).parents[3] / "docs" / "recordings.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1:-1] for line in text.splitlines() if line.startswith("| `")]
    listed = [tuple(cell.strip().strip("`") for cell in cells) for cells in rows]
    machine = [(c.name, c.unit, c.dtype, c.meaning) for c in MACHINE_CHANNELS]
    axis = [(f"<axis>.{c.name}", c.unit, c.dtype, c.meaning) for c in AXIS_CHANNELS]
    assert [entry for entry in listed if len(entry) == 4] == machine + axis
