"""Learning over the bus, from the first stroke to the version in use, with interruptions."""

import asyncio
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.run.report import Progress, RunReport
from servo_ctrl.daemon.run.run_options import LearningRequest
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.learned.store import LearnedStore
from servo_ctrl.recording.reader import load_recording

SHORT = {
    "radius_mm = 50.0": "radius_mm = 2.0\ntrailing = false",
    "accelerations_mm_s2 = [2.0, 8.0, 30.0, 120.0]": "accelerations_mm_s2 = [400.0, 500.0, 600.0, 700.0]",
    "jerk_mm_s3 = 50000.0": "jerk_mm_s3 = 500000.0",
}
"""Strokes of half a second: too short for production, but the same code."""
SDO_REQUEST = 0x600 + 127
ABORT, PAUSE, RESUME, START = 2, 3, 4, 1


def command(value: int, index: int = 0x2100) -> bytes:
    """SDO download of one byte to 2100h, the command."""
    return bytes((0x2F, index & 0xFF, index >> 8, 0x00, value, 0, 0, 0))


SELECT_X = command(1, 0x2101)


class Steps:
    """Actions in order, each at the first progress report for which its condition holds."""

    def __init__(self, *steps: tuple[Callable[[Progress], bool], Callable[[], object]]) -> None:
        self._steps = list(steps)

    def __call__(self, progress: Progress) -> None:
        if self._steps and self._steps[0][0](progress):
            self._steps.pop(0)[1]()


def strokes(progress: Progress) -> int:
    return progress.learning.strokes_done


async def learn_x(bench: Any, machine_dir: Path, record: Path | None = None, **options: Any) -> RunReport:
    request = LearningRequest(("x",))
    return await run_machine(
        load_machine(machine_dir), None, bench.bus_spec, "lockstep", record, learn=request, **options
    )


async def test_axis_learns_and_uses_what_it_has_learned_and_learns_the_very_same_again(
    bench: Any, tmp_path: Path
) -> None:
    machine_dir = bench.machine(SHORT)
    simulator = bench.simulate(machine_dir)
    seen: list[Progress] = []
    report = await learn_x(bench, machine_dir, tmp_path / "r", on_progress=seen.append)
    assert (report.completed, report.failed, report.reason) == (True, False, "")
    assert report.learning.state is LearningState.DONE
    [outcome] = report.outcomes
    assert (outcome.axis, outcome.version, outcome.resumed) == ("x", 1, 0)
    assert outcome.learned.after_m < outcome.learned.before_m
    # every stroke is a segment of the recording, on x alone
    recording = load_recording(tmp_path / "r")
    labels = [segment["label"] for segment in recording.header["segments"]]
    assert len(labels) == outcome.learned.strokes == len(report.spans)
    assert set(labels) == {"interval", "search", "check"}
    moving = recording.columns["segment"] >= 0
    assert np.ptp(recording.columns["x.position_command_m"][moving]) == pytest.approx(4e-3)
    assert np.ptp(recording.columns["y.position_command_m"][moving]) == 0.0
    # a pulse acts in its own stroke only
    at_search = recording.columns["segment"] == labels.index("search")
    at_interval = recording.columns["segment"] == labels.index("interval")
    assert np.abs(recording.columns["x.pulse_m_s"][at_search]).max() > 1e-4
    assert not recording.columns["x.pulse_m_s"][at_interval].any()
    assert not recording.columns["y.pulse_m_s"][moving].any()
    # progress never goes back
    shares = [progress.done for progress in seen if progress.learning.planned]
    assert len(shares) > 3
    assert shares[-1] == 1.0
    stored = LearnedStore(machine_dir / "learned", load_machine(machine_dir)).active("x")
    assert stored is not None
    assert stored.learned == outcome.learned
    simulator.terminate()
    simulator.wait(timeout=10.0)
    bench.simulate(machine_dir)
    again = await learn_x(bench, machine_dir, learned_dir=tmp_path / "again")
    assert (again.outcomes[0].learned, again.cycles) == (outcome.learned, report.cycles)


async def test_fault_of_a_drive_keeps_what_was_in_use_and_the_next_run_goes_on(
    bench: Any, tmp_path: Path
) -> None:
    machine_dir = bench.machine(SHORT)
    bench.simulate(machine_dir)
    with bench.monitor() as monitor:
        fault = (0x082, bytes.fromhex("1042 09 0000000000"))
        steps = Steps((lambda p: strokes(p) >= 3, lambda: monitor.send(*fault)))
        report = await learn_x(bench, machine_dir, tmp_path / "r", on_progress=steps)
    assert (report.completed, report.failed, report.outcomes) == (False, True, ())
    assert report.reason.startswith("axis.y.drive (node 2): EMCY 4210h")
    assert report.learning.state is LearningState.FAILED
    assert not load_recording(tmp_path / "r").columns["x.velocity_command_m_s"][-1] > 0.0
    assert LearnedStore(machine_dir / "learned", load_machine(machine_dir)).active("x") is None
    again = await learn_x(bench, machine_dir)
    assert again.completed
    assert again.outcomes[0].resumed >= 3
    assert (
        again.events[0] == f"axis x: learning goes on after {again.outcomes[0].resumed} strokes made before"
    )


async def test_pause_resume_and_abort_over_the_bus(bench: Any, tmp_path: Path) -> None:
    """A ready machine learns on command, and is ready again after an abort."""
    machine_dir = bench.machine(SHORT)
    bench.simulate(machine_dir)
    states: list[tuple[LearningState, int]] = []
    with bench.monitor() as monitor:

        def send(value: int) -> Callable[[], None]:
            return lambda: monitor.send(SDO_REQUEST, command(value))

        steps = Steps(
            (lambda p: p.stage is Stage.READY, lambda: monitor.send(SDO_REQUEST, SELECT_X)),
            (lambda p: p.stage is Stage.READY, send(START)),
            (lambda p: strokes(p) >= 1, send(PAUSE)),
            (lambda p: p.learning.state is LearningState.PAUSED, send(RESUME)),
            (lambda p: p.learning.state is LearningState.RUNNING and strokes(p) >= 3, send(START)),
            (lambda p: strokes(p) >= 5 and p.stage is Stage.RUNNING, send(ABORT)),
            (
                lambda p: p.learning.state is LearningState.ABORTED and p.stage is Stage.READY,
                lambda: os.kill(os.getpid(), signal.SIGTERM),
            ),
        )

        def on_progress(progress: Progress) -> None:
            states.append((progress.learning.state, strokes(progress)))
            steps(progress)

        machine = load_machine(machine_dir)
        async with asyncio.timeout(120.0):
            report = await run_machine(machine, None, bench.bus_spec, "lockstep", tmp_path / "r", on_progress)
    assert (report.signal, report.failed, report.outcomes) == ("SIGTERM", False, ())
    order = list(dict.fromkeys(state for state, _ in states))
    assert [s for s in order if s is not LearningState.PAUSING] == [
        LearningState.IDLE,
        LearningState.RUNNING,
        LearningState.PAUSED,
        LearningState.ABORTED,
    ]
    assert not (machine_dir / "learned" / "x" / "journal.jsonl").exists()
    # the second start was refused: wrong state (0800 0022h)
    answers = [data for can_id, data in monitor.frames if can_id == 0x580 + 127]
    assert bytes.fromhex("80 002100 22000008".replace(" ", "")) in answers
    # the abort was a ramp: never more than the machine's limit, and no jump
    commands = load_recording(tmp_path / "r").columns["x.velocity_command_m_s"]
    commands = commands[np.isfinite(commands)]
    assert np.abs(np.diff(commands)).max() <= 2.0e-3 * 1.001


async def test_an_exception_beside_the_cycle_stops_it_and_the_nodes(
    bench: Any, xy_table: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.simulate(xy_table)

    async def buggy(_self: BackgroundWorker) -> None:
        await asyncio.sleep(0.2)
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(BackgroundWorker, "run", buggy)
    with bench.monitor() as monitor, pytest.raises(ZeroDivisionError, match="a bug"):
        async with asyncio.timeout(60.0):
            await run_machine(load_machine(xy_table), None, bench.bus_spec, "lockstep")
    assert (0x000, b"\x80\x0c") in monitor.frames


def start_learning(bench: Any, machine_dir: Path) -> subprocess.Popen[str]:
    program = str(Path(sys.executable).with_name("servo-ctrl"))
    command_line = [program, "learn", "--machine", str(machine_dir), "--bus", bench.bus_spec, "--axis", "x"]
    return subprocess.Popen(
        [*command_line, "--pacing", "lockstep"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def wait_for_strokes(journal: Path, count: int) -> None:
    deadline_s = time.monotonic() + 120.0
    while not journal.exists() or journal.read_bytes().count(b"\n") <= count:
        assert time.monotonic() < deadline_s, "no strokes came"
        time.sleep(0.02)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_learning_that_was_killed_goes_on_with_the_same_command(bench: Any, number: signal.Signals) -> None:
    machine_dir = bench.machine(SHORT)
    simulator = bench.simulate(machine_dir)
    journal = machine_dir / "learned" / "x" / "journal.jsonl"
    first = start_learning(bench, machine_dir)
    wait_for_strokes(journal, 4)
    first.send_signal(number)
    output, errors = first.communicate(timeout=60.0)
    if number is signal.SIGINT:
        assert first.returncode == 128 + signal.SIGINT
        assert "run the same command again to go on" in errors
    made = journal.read_bytes().count(b"\n") - 1
    assert made >= 4
    if number is signal.SIGKILL:  # the drives were not stopped: a new simulator stands for a machine at rest
        simulator.kill()
        simulator.wait(timeout=10.0)
        bench.simulate(machine_dir)
    second = start_learning(bench, machine_dir)
    output, errors = second.communicate(timeout=120.0)
    assert second.returncode == 0, errors
    assert f"({made} of an earlier run)" in output
    assert "version 1" in output
    assert f"learning goes on after {made} strokes made before" in errors
    assert not journal.exists()
    stored = json.loads((machine_dir / "learned" / "x" / "v0001.json").read_text(encoding="utf-8"))
    assert stored["conditions"]["strokes_resumed"] == made
