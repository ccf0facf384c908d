"""The real `reconcile diagnose` from the page: its steps, a concealed effect, the model that is accepted."""

import asyncio
import math
import tomllib
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from nicegui import ui
from page_in_process import PageInProcess

from servo_ctrl.hmi.diagnosis import page as diagnosis
from servo_ctrl.hmi.diagnosis.diagnoses import diagnoses_of
from servo_ctrl.hmi.diagnosis.verdict import improvements, read_verdict
from servo_ctrl.hmi.shell import program_process

MODEL = """[axis.x]
transmission.lead_mm = 5.0
motor.torque_constant_nm_a = 0.4
table.mass_kg = 50.0
viscous_friction.viscous_n_s_m = 100.0
"""
COGGING_N = 6.0
"""What the recorded axis has and the model lacks: one period a turn of the screw."""
NOISE_N = 0.3
LIMIT_S = 300.0


@pytest.fixture(autouse=True)
def _no_way_is_given(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside other tests a program that gives way gets a hundredth of a processor."""
    monkeypatch.setattr(program_process, "NICENESS", 0)


def recorded(path: Path) -> None:
    """A rigid axis that the model describes but for its cogging, by Newton's law; no scale."""
    time_s = np.arange(12_000) * 1e-3
    slow, fast = 2.0 * math.pi * 0.31, 2.0 * math.pi * 1.13
    position = 0.02 * np.sin(slow * time_s) + 0.008 * np.sin(fast * time_s)
    velocity = 0.02 * slow * np.cos(slow * time_s) + 0.008 * fast * np.cos(fast * time_s)
    change = -0.02 * slow**2 * np.sin(slow * time_s) - 0.008 * fast**2 * np.sin(fast * time_s)
    noise = np.random.default_rng(3).normal(size=len(time_s)) * NOISE_N
    force = 50.0 * change + 100.0 * velocity + COGGING_N * np.sin(2.0 * math.pi * position / 0.005) + noise
    columns = np.stack((time_s, position, force), axis=1)
    header = "time_s,motor_position_m,motor_force_n"
    np.savetxt(path, columns, delimiter=",", comments="", header=header)  # type: ignore[arg-type]


async def test_a_concealed_effect_is_named_and_the_model_with_it_is_accepted(
    shown_page: PageInProcess, tmp_path: Path
) -> None:
    page, user, machine = shown_page, shown_page.user, tmp_path / "machine"
    machine.mkdir()
    (machine / "nominal.toml").write_text(MODEL)
    await asyncio.to_thread(recorded, tmp_path / "run.csv")
    page.link.hello = page.link.hello._replace(machine_file=str(machine / "controller.toml"))
    await page.show(diagnosis.build)
    await page.until(lambda: page.shows("No recordings here yet"))
    user.find(marker="recording-path").type(str(tmp_path / "run.csv"))
    user.find(marker="add-recording").click()
    await page.until(lambda: page.shows("1 recording picked"))
    user.find(marker="run-diagnosis").click()
    await page.until(lambda: page.shows("leaves out physics"), LIMIT_S)
    await page.until(lambda: page.shows("Axis x: cogging"))
    [job] = diagnoses_of(tmp_path).jobs
    steps = ["reading", "checking timing and sensors", "axis x: force", "locating", "report", "done"]
    assert [line for line in job.lines if line in steps] == steps
    assert not any("format" in line for line in job.lines), "every step is understood"
    [force] = improvements(read_verdict(job.directory / "verdict.json"))
    assert force.levels[0] > 3.0 * force.levels[2]
    assert "Content-Security-Policy" in (job.directory / "report.html").read_text()

    (target,) = user.find(marker="accept-target").elements
    cast("ui.input", target).set_value("repaired.toml")
    user.find(marker="accept-model").click()
    await page.until(lambda: page.shows("There is no file yet."))
    user.find(marker="confirm").click()
    await page.until(lambda: page.shows("is the repaired model now"))
    repaired = tomllib.loads((machine / "repaired.toml").read_text())
    assert "cogging" in str(repaired["axis"]["x"])
