"""Learning a waveform over the bus, storing it, switching it and rolling it back by SDO."""

import asyncio
from pathlib import Path
from typing import Any

import pytest

from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.run.run_options import LearningRequest
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.learned.store import WaveformStore
from servo_ctrl.learning import rest_force, waveform_run
from servo_ctrl.recording.reader import load_recording

SHORT = {
    "radius_mm = 50.0": "radius_mm = 12.0",
    "accelerations_mm_s2 = [2.0, 8.0, 30.0, 120.0]": "accelerations_mm_s2 = [200.0, 210.0, 220.0, 240.0]\n"
    "rests_s = [0.2]",
    "jerk_mm_s3 = 50000.0": "jerk_mm_s3 = 500000.0",
}
"""Strokes of one and a half seconds, and rests."""


async def test_a_waveform_is_learned_over_the_bus_stored_and_used(
    bench: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(waveform_run, "ACCELERATIONS", 1)
    monkeypatch.setattr(waveform_run, "ITERATIONS", 2)
    monkeypatch.setattr(rest_force, "ITERATIONS", 2)
    machine_dir = bench.machine(SHORT)
    bench.simulate(machine_dir)
    machine = load_machine(machine_dir)
    async with asyncio.timeout(120.0):
        report = await run_machine(
            machine,
            None,
            bench.bus_spec,
            "lockstep",
            tmp_path / "r",
            learn=LearningRequest(("x",), "waveform"),
        )
    assert (report.completed, report.failed, report.reason) == (True, False, "")
    [outcome] = report.outcomes
    assert (outcome.version, outcome.learned.strokes) == (1, 8)
    assert outcome.learned.after_m < 0.5 * outcome.learned.before_m
    stored = WaveformStore(machine_dir / "learned", machine).active("x")
    assert stored is not None
    assert stored.learned == outcome.learned
    recording = load_recording(tmp_path / "r")
    labels = [segment["label"] for segment in recording.header["segments"]]
    assert labels[:4] == ["identify"] * 2 + ["waveform"] * 2
    assert [label for label in labels[4:] if label != "to the centre"] == ["rest"] * 18 + ["check"] * 2
    assert [row.rest_s for row in outcome.learned.rests] == [0.2]
    assert not recording.columns["x.pulse_m_s"][recording.columns["segment"] >= 0].any()
