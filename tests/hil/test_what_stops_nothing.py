"""A full disk, a clock that jumps, a machine file that is edited: noted under way, and the axes go on."""

from __future__ import annotations

import errno
import itertools
import time
from typing import TYPE_CHECKING, Any

from servo_ctrl.axis.fault_policy import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon import changed_files
from servo_ctrl.daemon.supervisor import run_machine
from servo_ctrl.telemetry import recorder
from servo_ctrl.telemetry.read import load_recording

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

    from servo_ctrl.daemon.report import Progress

PROGRAM = """
[[step]]
kind = "circle"
label = "round"
radius_mm = 5.0
feed_mm_min = 3000.0
turns = 7.5
"""
HOUR_S = 3600.0


async def test_full_disk_clock_step_and_changed_file_are_noted_and_stop_nothing(
    bench: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine_dir = bench.machine({})
    bench.simulate(machine_dir)
    program = tmp_path / "program.toml"
    program.write_text(PROGRAM, encoding="utf-8")
    machine = load_machine(machine_dir)
    monkeypatch.setattr(changed_files, "LOOK_S", 0.02)
    write_part, now_s, jumps = recorder.write_part, time.time, itertools.cycle((HOUR_S, -HOUR_S, 0.0))
    monkeypatch.setattr(time, "time", lambda: now_s() + next(jumps))
    trouble = False
    heard: list[tuple[str, ...]] = []

    def full(*args: Any) -> None:
        if trouble:
            raise OSError(errno.ENOSPC, "No space left on device")
        write_part(*args)

    monkeypatch.setattr(recorder, "write_part", full)

    def on_progress(progress: Progress) -> None:
        nonlocal trouble
        first_part = tmp_path / "r" / "part-00000.parquet"
        if progress.stage is Stage.RUNNING and first_part.exists() and not trouble:
            trouble = True
            with (machine_dir / "controller.toml").open("a", encoding="utf-8") as file:
                file.write("# edited\n")
        if progress.stage is Stage.RUNNING:
            heard.append(progress.events)

    report = await run_machine(
        machine, load_program(program, machine), bench.bus_spec, "lockstep", tmp_path / "r", on_progress
    )
    assert report.completed
    changed = (
        f"{machine_dir / 'controller.toml'} was changed under way: the run goes on with what it has read"
    )
    assert any(changed in events for events in heard)
    full_text = "the recording ends here: "
    assert any(text.startswith(full_text) for events in heard for text in events)
    assert report.failed
    assert "No space left on device" in report.reason
    columns = load_recording(tmp_path / "r").columns
    assert columns["cycle"].tolist() == list(range(len(columns["cycle"])))
    assert len(columns["cycle"]) >= recorder.ROWS_PER_PART
