"""A machine that stays under control: its program again, its learned pulse, learning due."""

import asyncio
import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from learned_examples import SHORT_STROKES
from program_steps import circle

from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.run.report import Progress, RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.learned.store import LearnedStore
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.recording.reversal_log import read_reversals

SDO_REQUEST, EMERGENCY = 0x600 + 127, 0x080 + 127
START_PROGRAM = bytes.fromhex("2F0021000A000000")
WRONG_STATE = bytes.fromhex("8000210022000008")


async def run_circle(
    bench: Any, machine_dir: Path, directory: Path, turns: float, **options: Any
) -> RunReport:
    path = machine_dir / "circle.toml"
    path.write_text(circle(25.0, 3000.0, turns), encoding="utf-8")
    machine = load_machine(machine_dir)
    async with asyncio.timeout(120.0):
        return await run_machine(
            machine, load_program(path, machine), bench.bus_spec, "lockstep", directory, **options
        )


def mean_errors_um(directory: Path, axis: str) -> list[float]:
    return [entry["error_mean_m"] * 1e6 for entry in read_reversals(directory) if entry["axis"] == axis]


async def test_a_served_program_is_run_again_on_request_and_recorded_as_its_own_segment(
    bench: Any, tmp_path: Path
) -> None:
    machine_dir = bench.machine({})
    bench.simulate(machine_dir)
    asked: list[str] = []
    with bench.monitor() as monitor:

        def on_progress(progress: Progress) -> None:
            if not asked and progress.stage is Stage.RUNNING:
                asked.append("while it runs")
                monitor.send(SDO_REQUEST, START_PROGRAM)
            elif len(asked) == 1 and progress.stage is Stage.READY and progress.cycle > 1000:
                asked.append("when it has ended")
                monitor.send(SDO_REQUEST, START_PROGRAM)
            elif len(asked) == 2 and progress.stage is Stage.RUNNING:
                asked.append("and it runs")
            elif len(asked) == 3 and progress.stage is Stage.READY:
                asked.append("stop")
                os.kill(os.getpid(), signal.SIGTERM)

        report = await run_circle(
            bench, machine_dir, tmp_path / "r", 0.5, on_progress=on_progress, serve=True
        )
    answers = [data for can_id, data in monitor.frames if can_id == 0x580 + 127]
    assert answers[0] == WRONG_STATE
    assert answers[1][0] == 0x60
    assert (report.completed, report.failed, report.signal) == (True, False, "SIGTERM")
    assert [span.step for span in report.spans] == [0, 1]
    recording = load_recording(tmp_path / "r")
    assert [segment["label"] for segment in recording.header["segments"]] == ["round", "round"]
    commands = recording.columns["x.position_command_m"]
    commands = commands[np.isfinite(commands)]
    assert np.abs(np.diff(commands)).max() < 60e-6, "no jump from one to the next"
    assert commands[-1] - commands[0] == pytest.approx(-0.1, abs=1e-9), "two half turns to the left"


async def test_learned_pulse_reduces_the_errors_at_the_reversals(bench: Any, tmp_path: Path) -> None:
    machine_dir = bench.machine({})
    store = LearnedStore(tmp_path / "functions", load_machine(machine_dir))
    for axis in ("x", "y"):
        store.add(axis, SHORT_STROKES, {"source": "test"})
    errors = {}
    for compensation in ("off", "pulse"):
        simulator = bench.simulate(machine_dir)
        directory = tmp_path / compensation
        report = await run_circle(
            bench, machine_dir, directory, 1.3, learned_dir=tmp_path / "functions", compensation=compensation
        )
        simulator.terminate()
        simulator.wait(timeout=10.0)
        assert report.completed
        errors[compensation] = [np.mean(mean_errors_um(directory, axis)) for axis in ("x", "y")]
        pulses = load_recording(directory).columns["x.pulse_m_s"]
        assert np.nanmax(np.abs(pulses)) == (0.0 if compensation == "off" else pytest.approx(1.4e-3, rel=0.1))
    for axis in (0, 1):
        assert errors["pulse"][axis] < 0.6 * errors["off"][axis]


async def test_observer_reduces_the_errors_too_and_is_off_by_default(bench: Any, tmp_path: Path) -> None:
    machine_dir = bench.machine({})
    errors = {}
    for compensation in ("as configured", "observer"):
        simulator = bench.simulate(machine_dir)
        directory = tmp_path / compensation
        await run_circle(bench, machine_dir, directory, 0.8, compensation=compensation)
        simulator.terminate()
        simulator.wait(timeout=10.0)
        errors[compensation] = np.mean(mean_errors_um(directory, "x"))
        added = np.nanmax(np.abs(load_recording(directory).columns["x.disturbance_n"]))
        assert (added > 0.0) == (compensation == "observer")
    assert errors["observer"] < errors["as configured"]


async def test_learning_due_is_reported_without_an_emergency(bench: Any, tmp_path: Path) -> None:
    machine_dir = bench.machine({"required_um = 4.0": "required_um = 2.0\ndue_after_reversals = 2"})
    bench.simulate(machine_dir)
    with bench.monitor() as monitor:
        report = await run_circle(bench, machine_dir, tmp_path / "r", 1.6)
    emergencies = [data for can_id, data in monitor.frames if can_id == EMERGENCY]
    statuses = [data for can_id, data in monitor.frames if can_id == 0x180 + 127]
    assert report.completed
    due = [text for text in report.events if text.startswith("axis x: learning is due: J ")]
    assert len(due) == 1
    assert due[0].endswith(" um over 2.0 um, 2 reversals in a row")
    assert emergencies == []
    assert {data[2] for data in statuses} >= {0b00, 0b11}, "the mask of axes in the status TPDO"
    entries = read_reversals(tmp_path / "r")
    of_x = [entry["due"] for entry in entries if entry["axis"] == "x"]
    assert of_x[:2] == [False, True]


async def test_damaged_result_is_reported_and_the_machine_runs_without_its_pulse(
    bench: Any, tmp_path: Path
) -> None:
    machine_dir = bench.machine({})
    LearnedStore(machine_dir / "learned", load_machine(machine_dir)).add("x", SHORT_STROKES, {})
    path = machine_dir / "learned" / "x" / "v0001.json"
    path.write_text(path.read_text(encoding="utf-8").replace("0.05", "0.06"), encoding="utf-8")
    bench.simulate(machine_dir)
    report = await run_circle(bench, machine_dir, tmp_path / "r", 0.6)
    assert (report.completed, report.failed) == (True, False)
    assert report.events[0].startswith("axis x runs without its learned pulse: ")
    assert "v0001.json" in report.events[0]
    assert not np.nanmax(np.abs(load_recording(tmp_path / "r").columns["x.pulse_m_s"]))


async def test_adaptation_makes_a_pulse_that_is_too_small_larger_and_keeps_it(
    bench: Any, tmp_path: Path
) -> None:
    machine_dir = bench.machine({'learner = "fast"': 'learner = "fast"\nadaptation = true'})
    store = LearnedStore(machine_dir / "learned", load_machine(machine_dir))
    small = tuple((a, 0.5 * amplitude_m_s) for a, amplitude_m_s in SHORT_STROKES.amplitudes)
    store.add("x", SHORT_STROKES._replace(amplitudes=small, after_m=0.5e-6), {})
    bench.simulate(machine_dir)
    report = await run_circle(bench, machine_dir, tmp_path / "r", 5.5)
    assert report.completed
    errors = mean_errors_um(tmp_path / "r", "x")
    assert np.mean(errors[-2:]) < np.mean(errors[:2])
    stored = store.active("x")
    assert stored is not None
    assert (stored.version, stored.conditions["source"]) == (2, "adaptation")
    assert stored.learned.amplitudes[1][1] > 1.1 * small[1][1]
    assert store.active("y") is None
