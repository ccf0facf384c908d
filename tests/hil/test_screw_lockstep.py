"""Learning the screw error over the bus: a table of the plant's error; an abort keeps the old table."""

import asyncio
import os
import re
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from screw_stand import stage_file

from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.run.report import Progress
from servo_ctrl.daemon.run.run_options import LearningRequest
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.learned.store import ScrewStore
from servo_ctrl.learning.screw import error_table
from servo_ctrl.recording.reader import load_recording

TO_OUR_SDO_SERVER = 0x67F
SELECT_LEARNER_2 = bytes.fromhex("2F 0421 02 02000000")
START, ABORT = (bytes.fromhex(f"2F 0021 00 0{command}000000") for command in (1, 2))


@pytest.fixture
def stage(bench: Any) -> Path:
    """The precision stage with a travel of 12 mm, simulated."""
    machine_dir: Path = bench.machine({}, "precision_stage")
    stage_file(machine_dir)
    bench.simulate(machine_dir)
    return machine_dir


def plant_value(machine_dir: Path, key: str) -> float:
    found = re.search(
        rf"^{key} = ([0-9.]+)", (machine_dir / "plant.toml").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert found, key
    return float(found[1])


async def test_screw_is_learned_and_aborted_over_the_bus(bench: Any, stage: Path, tmp_path: Path) -> None:
    machine = load_machine(stage)
    async with asyncio.timeout(120.0):
        report = await run_machine(
            machine, None, bench.bus_spec, "lockstep", tmp_path / "r", learn=LearningRequest(("x",), "screw")
        )
    assert (report.completed, report.failed, report.reason) == (True, False, "")
    [outcome] = report.outcomes
    assert (outcome.version, outcome.learned.strokes) == (1, 3)
    assert outcome.learned.after_m < 0.2 * outcome.learned.before_m
    stored = ScrewStore(stage / "learned", machine).active("x")
    assert stored is not None
    assert stored.learned == outcome.learned
    # the wobble of the plant's screw: a turn of 5 mm, found by least squares
    position_m, error_m = error_table(stored.learned)
    turns = 2.0 * np.pi * (position_m - error_m) / 5e-3
    columns = np.stack([np.ones_like(turns), turns, np.sin(turns), np.cos(turns)], axis=1)
    _, _, sine_m, cosine_m = np.linalg.lstsq(columns, error_m)[0]
    wobble_m = float(np.hypot(sine_m, cosine_m))
    assert wobble_m == pytest.approx(plant_value(stage, "amplitude_um") * 1e-6, rel=0.03)
    # play, and what friction winds up
    assert stored.learned.lost_motion_m > plant_value(stage, "play_um") * 1e-6
    recording = load_recording(tmp_path / "r")
    labels = [segment["label"] for segment in recording.header["segments"]]
    assert labels.count("travel up") == labels.count("travel down") == 3
    corrections_m, segment = recording.columns["x.correction_m"], recording.columns["segment"]
    first = segment == labels.index("travel up")
    last = segment == len(labels) - 1 - labels[::-1].index("travel up")
    assert not corrections_m[first].any()
    assert np.ptp(corrections_m[last]) > wobble_m

    await _abort_the_next(bench, stage)
    kept = ScrewStore(stage / "learned", machine).active("x")
    assert kept == stored


async def _abort_the_next(bench: Any, stage: Path) -> None:
    """Learn again by SDO, and abort in the second travel."""
    steps: list[tuple[Callable[[Progress], bool], Callable[[], object]]] = []
    states: list[LearningState] = []

    def on_progress(progress: Progress) -> None:
        states.append(progress.learning.state)
        if steps and steps[0][0](progress):
            steps.pop(0)[1]()

    def made(progress: Progress) -> int:
        return progress.learning.strokes_done

    with bench.monitor() as monitor:

        def send(payload: bytes) -> Callable[[], None]:
            return lambda: monitor.send(TO_OUR_SDO_SERVER, payload)

        steps += [
            (lambda p: p.stage is Stage.READY, send(SELECT_LEARNER_2)),
            (lambda p: p.stage is Stage.READY, send(START)),
            (lambda p: made(p) >= 1 and p.stage is Stage.RUNNING, send(ABORT)),
            (
                lambda p: p.learning.state is LearningState.ABORTED and p.stage is Stage.READY,
                lambda: os.kill(os.getpid(), signal.SIGTERM),
            ),
        ]
        async with asyncio.timeout(120.0):
            report = await run_machine(
                load_machine(stage), None, bench.bus_spec, "lockstep", None, on_progress
            )
    assert (report.signal, report.failed, report.outcomes) == ("SIGTERM", False, ())
    assert LearningState.RUNNING in states
    assert states[-1] is LearningState.ABORTED
