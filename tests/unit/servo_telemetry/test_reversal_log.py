"""The log of reversals: whole, torn off by a real kill -9, on a disk that does not play along."""

import json
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from servo_ctrl.learning.types import ReversalReport
from servo_ctrl.recording import reversal_log as log_module
from servo_ctrl.recording.recorder import RecordingError
from servo_ctrl.recording.reversal_log import (
    MAX_WAITING_REVERSALS,
    REVERSALS_FILE,
    ReversalLog,
    read_reversals,
    reversal_entry,
)

REPORT = ReversalReport(
    cycle=4962,
    direction=-1,
    acceleration_m_s2=0.1,
    contour_peak_m=9e-6,
    error_peak_m=8e-6,
    error_rms_m=5e-6,
    error_mean_m=4.1e-6,
)


def entry(cycle: int) -> dict[str, Any]:
    return reversal_entry(REPORT._replace(cycle=cycle), "y", 1e-3, due=cycle > 5)


@pytest.fixture(autouse=True)
def no_writer_is_left() -> Iterator[None]:
    yield
    assert "reversal log" not in {thread.name for thread in threading.enumerate()}


def test_line_has_time_indicators_and_whether_learning_is_due() -> None:
    assert reversal_entry(REPORT, "y", 1e-3, due=True) == {
        "axis": "y",
        "cycle": 4962,
        "time_s": pytest.approx(4.962),
        "direction": -1,
        "acceleration_m_s2": 0.1,
        "contour_peak_m": 9e-6,
        "error_peak_m": 8e-6,
        "error_rms_m": 5e-6,
        "error_mean_m": 4.1e-6,
        "due": True,
    }


def test_reversals_come_back_in_order(tmp_path: Path) -> None:
    log = ReversalLog(tmp_path / "r" / REVERSALS_FILE)
    entries = [entry(cycle) for cycle in range(10)]
    for one in entries:
        log.add(one)
    log.close()
    assert read_reversals(tmp_path / "r") == entries
    assert log.lost == 0


def test_run_without_a_reversal_has_an_empty_log(tmp_path: Path) -> None:
    ReversalLog(tmp_path / REVERSALS_FILE).close()
    assert read_reversals(tmp_path) == []


KILLED = """
import sys, time
from pathlib import Path
from servo_ctrl.recording.reversal_log import ReversalLog, read_reversals
path = Path(sys.argv[1])
log = ReversalLog(path)
number = 0
announced = False
while True:
    log.add({"number": number})
    number += 1
    time.sleep(0.0005)
    if number >= 100 and not announced and len(read_reversals(path.parent)) >= 100:
        print("going on", flush=True)
        announced = True
"""


def test_log_is_readable_after_kill_9(tmp_path: Path) -> None:
    path = tmp_path / REVERSALS_FILE
    with subprocess.Popen([sys.executable, "-c", KILLED, str(path)], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"going on\n"
        process.send_signal(signal.SIGKILL)
        assert process.wait(timeout=10.0) == -signal.SIGKILL
    numbers = [one["number"] for one in read_reversals(tmp_path)]
    assert len(numbers) >= 100
    assert numbers == list(range(len(numbers)))


def test_half_a_line_at_the_end_is_left_out(tmp_path: Path) -> None:
    log = ReversalLog(tmp_path / REVERSALS_FILE)
    log.add(entry(1))
    log.close()
    with (tmp_path / REVERSALS_FILE).open("a", encoding="utf-8") as file:
        file.write(json.dumps(entry(2))[:-9])
    assert read_reversals(tmp_path) == [entry(1)]


@pytest.mark.parametrize("line", [b"", b"nonsense", b"[1]", b"\xff\xfe", b"[" * 100_000])
def test_damaged_line_is_named(tmp_path: Path, line: bytes) -> None:
    (tmp_path / REVERSALS_FILE).write_bytes(b'{"axis": "x"}\n' + line + b'\n{"axis": "y"}\n')
    with pytest.raises(RecordingError, match=rf"{REVERSALS_FILE}: line 2 is not a reversal"):
        read_reversals(tmp_path)


def test_directory_without_a_log_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=rf"{REVERSALS_FILE}: cannot be read: No such file"):
        read_reversals(tmp_path)


def test_log_is_never_written_over(tmp_path: Path) -> None:
    ReversalLog(tmp_path / REVERSALS_FILE).close()
    with pytest.raises(RecordingError, match="is there already"):
        ReversalLog(tmp_path / REVERSALS_FILE)


def test_unwritable_directory_is_refused_at_the_start(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(RecordingError, match="cannot be written: File exists"):
        ReversalLog(tmp_path / "file" / REVERSALS_FILE)


class FullDisk:
    """Takes some lines and half of the next."""

    def __init__(self, file: Any, lines: int) -> None:
        self._file, self._lines = file, lines

    def write(self, text: str) -> None:
        if self._lines == 0:
            self._file.write(text[:5])
            raise OSError(28, "No space left on device")
        self._lines -= 1
        self._file.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def __enter__(self) -> None:
        self._file.__enter__()

    def __exit__(self, *details: object) -> None:
        self._file.__exit__(*details)


def test_disk_that_is_full_is_reported_and_what_was_written_stays(tmp_path: Path) -> None:
    log = ReversalLog(tmp_path / REVERSALS_FILE)
    log._file = FullDisk(log._file, 3)  # type: ignore[assignment]
    for cycle in range(10):
        log.add(entry(cycle))
    with pytest.raises(
        RecordingError, match=r"cannot be written: No space left on device \(7 reversals lost"
    ):
        log.close()
    assert read_reversals(tmp_path) == [entry(cycle) for cycle in range(3)]


def test_entry_that_json_cannot_represent_is_reported_and_blocks_nothing(tmp_path: Path) -> None:
    log = ReversalLog(tmp_path / REVERSALS_FILE)
    log.add({"error_mean_m": float("nan")})
    log.add(entry(1))
    with pytest.raises(RecordingError, match=r"ValueError.*\(2 reversals lost\)"):
        log.close()


class StalledDisk(FullDisk):
    """Takes nothing until it is let go."""

    def __init__(self, file: Any) -> None:
        super().__init__(file, -1)
        self.reached, self.go = threading.Event(), threading.Event()

    def write(self, text: str) -> None:
        self.reached.set()
        assert self.go.wait(10.0)
        super().write(text)


def test_stalled_disk_loses_reversals_and_reports_how_many(tmp_path: Path) -> None:
    log = ReversalLog(tmp_path / REVERSALS_FILE)
    disk = log._file = StalledDisk(log._file)  # type: ignore[assignment]
    log.add(entry(0))
    assert disk.reached.wait(10.0)
    for cycle in range(MAX_WAITING_REVERSALS + 7):
        log.add(entry(cycle))
    disk.go.set()
    with pytest.raises(RecordingError, match="the disk was too slow, 7 reversals lost"):
        log.close()
    assert len(read_reversals(tmp_path)) == MAX_WAITING_REVERSALS + 1


def test_hanging_disk_does_not_block_closing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log_module, "CLOSE_LIMIT_S", 0.05)
    log = ReversalLog(tmp_path / REVERSALS_FILE)
    disk = log._file = StalledDisk(log._file)  # type: ignore[assignment]
    log.add(entry(0))
    with pytest.raises(RecordingError, match=r"did not take it within 0\.05 s"):
        log.close()
    disk.go.set()
    log._writer.join(10.0)
