"""The real `reconcile diagnose` as a job of the page: its lines, its files, its model."""

import asyncio
import math
from pathlib import Path

import numpy as np

from servo_ctrl.hmi.diagnosis.job import ENDED, DiagnosisJobs, JobState
from servo_ctrl.hmi.diagnosis.job_files import accept_model, read_model
from servo_ctrl.hmi.diagnosis.verdict import improvements, read_verdict

MODEL = """[axis.x]
transmission.lead_mm = 5.0
motor.torque_constant_nm_a = 0.4
table.mass_kg = 40.0
viscous_friction.viscous_n_s_m = 80.0
"""
NOISE_N = 0.3


def recorded(path: Path) -> None:
    """A rigid axis of 50 kg with 100 N s/m of damping, by Newton's law; no scale."""
    time_s = np.arange(20_000) * 1e-3
    slow, fast = 2.0 * math.pi * 0.31, 2.0 * math.pi * 1.13
    position = 0.02 * np.sin(slow * time_s) + 0.008 * np.sin(fast * time_s)
    velocity = 0.02 * slow * np.cos(slow * time_s) + 0.008 * fast * np.cos(fast * time_s)
    change = -0.02 * slow**2 * np.sin(slow * time_s) - 0.008 * fast**2 * np.sin(fast * time_s)
    noise = np.random.default_rng(3).normal(size=len(time_s)) * NOISE_N
    columns = np.stack((time_s, position, 50.0 * change + 100.0 * velocity + noise), axis=1)
    header = "time_s,motor_position_m,motor_force_n"
    np.savetxt(path, columns, delimiter=",", comments="", header=header)  # type: ignore[arg-type]


async def test_a_real_diagnosis_runs_reports_steps_and_its_model_is_accepted(tmp_path: Path) -> None:
    run, model = tmp_path / "run.csv", tmp_path / "nominal.toml"
    model.write_text(MODEL)
    await asyncio.to_thread(recorded, run)
    diagnoses = DiagnosisJobs(tmp_path / "jobs")
    job = await diagnoses.start([run], model, "ada")
    async with asyncio.timeout(200.0):
        while job.state not in ENDED:  # noqa: ASYNC110  # as a page looks at it
            await asyncio.sleep(0.05)
    assert job.state is JobState.DONE, job.lines
    steps = ["reading", "checking timing and sensors", "axis x: force", "locating", "report", "done"]
    assert [line for line in job.lines if line in steps] == steps
    assert (job.step, job.progress) == ("done", 1.0)
    assert not any("format" in line for line in job.lines), "every step is understood"
    verdict = read_verdict(job.directory / "verdict.json")
    assert verdict.verdict == "parameters"
    [force] = improvements(verdict)
    assert force.levels[0] > 3.0 * force.levels[2]
    report = (job.directory / "report.html").read_text()
    assert "Content-Security-Policy" in report
    target = tmp_path / "repaired.toml"
    accept_model(job.directory / "model.toml", target, "ada")
    assert list(read_model(target)["axis"]) == ["x"]
