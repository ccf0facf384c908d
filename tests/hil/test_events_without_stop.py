"""A full disk, a clock step, an edited machine file: reported during the run, and the axes continue."""

import errno
import itertools
import time
from pathlib import Path
from typing import Any

import pytest
from consecutive_runs import ConsecutiveRuns, Script
from program_steps import circle

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_program
from servo_ctrl.daemon.run import changed_files
from servo_ctrl.recording import recorder
from servo_ctrl.recording.reader import load_recording
from tests.campaigns.campaign.machine import make_machine
from tests.campaigns.campaign.stand import ROWS_PER_PART

PROGRAM = circle(2.0, 3000.0, turns=5.0)
HOUR_S, DISK_LIMIT_S = 3600.0, 20.0


def test_full_disk_clock_step_and_changed_file_are_reported_and_stop_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = make_machine(tmp_path)
    (tmp_path / "round.toml").write_text(PROGRAM, encoding="utf-8")
    table = ConsecutiveRuns(
        machine._replace(program=load_program(tmp_path / "round.toml", machine.controller)), tmp_path
    )
    monkeypatch.setattr(changed_files, "POLL_S", 0.02)
    write_part, now_s, jumps = recorder.write_part, time.time, itertools.cycle((HOUR_S, -HOUR_S, 0.0))
    monkeypatch.setattr(time, "time", lambda: now_s() + next(jumps))
    full: list[OSError] = []

    def written(*args: Any) -> None:
        if full:
            raise full[0]
        write_part(*args)

    monkeypatch.setattr(recorder, "write_part", written)
    changed = (
        f"{tmp_path / 'controller.toml'} was changed during the run, "
        "which continues with the content that it has read"
    )

    def noted(text: str) -> bool:
        return any(event.startswith(text) for event in table.machine.events.kept)

    def all_noted() -> bool:
        time.sleep(0.002)  # a thread watches the files, and simulated time runs ahead of it
        return noted(changed) and noted("the recording ends here: ")

    def script() -> Script:
        yield from table.ready_with_program()
        table.ask(Command.START_PROGRAM)
        yield ROWS_PER_PART
        deadline_s = time.monotonic() + DISK_LIMIT_S  # the disk is slower than simulated time
        while not (tmp_path / "recording" / "part-00000.parquet").exists():
            assert time.monotonic() < deadline_s
            time.sleep(0.002)
        full.append(OSError(errno.ENOSPC, "No space left on device"))
        with (tmp_path / "controller.toml").open("a", encoding="utf-8") as file:
            file.write("# edited\n")
        yield all_noted
        assert table.machine.stage is Stage.RUNNING
        yield table.at(Stage.READY)

    report = table.run(script, recording=tmp_path / "recording")
    table.close()
    assert report.completed
    assert report.failed
    assert "No space left on device" in report.reason
    columns = load_recording(tmp_path / "recording").columns
    assert columns["cycle"].tolist() == list(range(len(columns["cycle"])))
    assert len(columns["cycle"]) >= ROWS_PER_PART
