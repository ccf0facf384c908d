"""Writes one small file of every kind, as a release writes them.

`PYTHONPATH=tests/support .venv/bin/python tests/support/golden_formats.py 0.2`, once for each release; what
is there is never written again. The tests read all of them.
"""

import math
import shutil
import subprocess
import sys
import tempfile
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from journal_examples import SETTINGS
from learned_examples import LEARNED, stroke_of
from stub_link import StubLink
from synthetic_recording import circle, reversal, write_recording

from hil_sim.node import storage
from servo_ctrl.config.load import load_machine
from servo_ctrl.hmi.access.users import Role, add_token
from servo_ctrl.hmi.scope.appearance import ShownChannel, channel_unit
from servo_ctrl.hmi.scope.capture_files import save_capture
from servo_ctrl.hmi.scope.stream import CapturedRows
from servo_ctrl.hmi.shell.units import MM
from servo_ctrl.learned.pulse_model import LearnedFunctions
from servo_ctrl.learned.store import LearnedStore, ScrewStore
from servo_ctrl.learned.stroke_journal import StrokeJournal
from servo_ctrl.learning.screw import ScrewLearned
from servo_ctrl.recording.command_log import COMMANDS_FILE, CommandLog

ROOT = Path(__file__).parents[2]
FORMATS = ROOT / "tests" / "golden" / "formats"
TAKEN = datetime(2026, 11, 22, 3, 4, 5, tzinfo=UTC)
SCREW = ScrewLearned(
    points=((-0.1, -8e-6, 6e-6), (0.0, -1e-6, 6e-6), (0.1, 8e-6, 5.9e-6)),
    lost_motion_m=5.9e-6,
    spread_m=3e-8,
    before_m=5.04e-6,
    after_m=7e-8,
    strokes=4,
    machine_time_s=103.0,
)
NOMINAL = """[axis.x]
transmission.lead_mm = 5.0
motor.torque_constant_nm_a = 0.4
table.mass_kg = 40.0
viscous_friction.viscous_n_s_m = 80.0
drive.node_id = 1
drive.eds = "eds/servo_drive.eds"
"""
"""Nominal model of an axis whose true values are 50 kg and 100 N s/m."""


def write_all(folder: Path) -> None:
    """Write all files into a folder that does not exist yet."""
    folder.mkdir(parents=True)
    shutil.copytree(ROOT / "eds", folder / "eds")
    machine = folder / "machines" / "xy_table"
    (machine / "programs").mkdir(parents=True)
    for name in ("controller.toml", "plant.toml", "programs/circles.toml", "programs/bracket.ngc"):
        shutil.copy(ROOT / "machines" / "xy_table" / name, machine / name)
    _learned(folder)
    entries = [reversal("x", 0.1, 2e-6)]
    write_recording(folder / "recording", circle(lambda angle: 1e-6 * np.sin(angle), turns=0.2), entries)
    _capture(folder)
    log = CommandLog(folder / COMMANDS_FILE, print)
    asked = {"user": "anna", "role": "operate", "address": "192.0.2.7", "do": "command", "command": "home"}
    log.add({"time": "2026-11-22T03:04:05.678+00:00", "cycle": 7, **asked, "accepted": True})
    assert log.close() == ""
    add_token(folder / "access.toml", "anna", Role.OPERATE)
    storage._write(folder / "node_1.json", {(0x6065, 0): b"\x10\x27\x00\x00"})
    _diagnosis(folder / "diagnosis")


def _learned(folder: Path) -> None:
    machine = load_machine(folder / "machines" / "xy_table")
    LearnedStore(folder / "learned", machine).add("x", LEARNED, {"room": "warm"})
    ScrewStore(folder / "learned", machine).add("x", SCREW, {})
    basis = LearnedFunctions.basis(machine, "x")
    journal = StrokeJournal(folder / "learned", "x", SETTINGS, basis=basis)
    for number in range(2):
        journal.append(*stroke_of(number))


def _capture(folder: Path) -> None:
    link = StubLink()
    link.advance(200)
    first, values = link.rows.since(0)
    name = "x.position_error_m"
    channels = [ShownChannel(name, link.rows.place(name), channel_unit(name, "m", MM))]
    saved = save_capture(folder, link.hello, CapturedRows(first, values), channels, origin=0, taken=TAKEN)
    saved.rename(folder / "capture")


def _diagnosis(folder: Path) -> None:
    """Run a diagnosis of an axis by Newton's law; keep its verdict.json and model.toml."""
    time_s = np.arange(20_000) * 1e-3
    rates = 2.0 * math.pi * np.array([[0.31], [1.13]])
    reach_m = np.array([[0.02], [0.008]])
    position, velocity, change = (
        (reach_m * rates**order * np.sin(rates * time_s + order * math.pi / 2.0)).sum(axis=0)
        for order in range(3)
    )
    force = 50.0 * change + 100.0 * velocity + np.random.default_rng(3).normal(size=len(time_s)) * 0.3
    columns, header = np.stack((time_s, position, force), axis=1), "time_s,motor_position_m,motor_force_n"
    program = str(Path(sys.executable).with_name("reconcile"))
    with tempfile.TemporaryDirectory() as temporary:
        here = Path(temporary)
        shutil.copytree(ROOT / "eds", here / "eds")
        np.savetxt(here / "run.csv", columns, delimiter=",", comments="", header=header)
        (here / "nominal.toml").write_text(NOMINAL, encoding="utf-8")
        command = [program, "diagnose", "run.csv", "--model", "nominal.toml", "--out", "out"]
        subprocess.run(command, check=True, timeout=600, cwd=here)
        folder.mkdir()
        for name in ("verdict.json", "model.toml"):
            shutil.copy(here / "out" / name, folder / name)


if __name__ == "__main__":
    write_all(FORMATS / sys.argv[1])
