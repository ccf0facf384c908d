"""The log of commands and their users: on disk, complete lines only."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from servo_ctrl.recording import command_log
from servo_ctrl.recording.command_log import CommandLog, CommandLogError

KILLED = """
import os, sys
from pathlib import Path
from servo_ctrl.recording.command_log import CommandLog
synced, fsync = [], os.fsync
os.fsync = lambda file: (fsync(file), synced.append(1))
log = CommandLog(Path(sys.argv[1]), print)
for number in range(20):
    log.add({"number": number})
while len(synced) < 21:  # its directory's name, and the lines
    pass
os.kill(os.getpid(), 9)
"""


def numbers(path: Path) -> list[int]:
    return [json.loads(line)["number"] for line in path.read_text().splitlines()]


def test_lines_are_added_to_those_of_earlier_runs(tmp_path: Path) -> None:
    path = tmp_path / "learned" / "commands.jsonl"
    for number in range(3):
        log = CommandLog(path, pytest.fail)
        log.add({"number": number})
        assert not log.close()
    assert numbers(path) == [0, 1, 2]


def test_synchronised_lines_survive_a_kill(tmp_path: Path) -> None:
    path = tmp_path / "commands.jsonl"
    process = subprocess.run([sys.executable, "-c", KILLED, str(path)], timeout=60, check=False)
    assert process.returncode == -9
    assert numbers(path) == list(range(20))


def test_a_line_cut_by_a_crash_is_removed_before_the_next_is_written(tmp_path: Path) -> None:
    path = tmp_path / "commands.jsonl"
    path.write_text('{"number": 1}\n{"numb')
    log = CommandLog(path, pytest.fail)
    log.add({"number": 2})
    assert not log.close()
    assert numbers(path) == [1, 2]


def test_a_full_disk_leaves_complete_lines_is_reported_once_and_recovered_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, problems, write = tmp_path / "commands.jsonl", [], os.write
    room = [1]

    def short(file: int, data: bytes) -> int:
        room[0] -= 1
        return write(file, data if room[0] >= 0 or room[0] <= -3 else data[:4])

    monkeypatch.setattr(command_log.os, "write", short)
    log = CommandLog(path, problems.append)
    for number in range(5):
        log.add({"number": number})
    assert "2 requests are not in it" in log.close()
    assert numbers(path) == [0, 3, 4]
    assert len(problems) == 1
    assert "No space left" in problems[0]


def test_unwritable_directory_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(CommandLogError, match=r"commands\.jsonl: cannot be written"):
        CommandLog(tmp_path / "file" / "commands.jsonl", print)
