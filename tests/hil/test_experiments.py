"""The experiments end to end: daemon, hub and simulator as three processes, against published figures."""

import asyncio
import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import can
import pytest
from machine_files import XY_TABLE, text_of, write_controller, write_plant

from servo_ctrl.config.load import load_machine
from servo_ctrl.hil_rig.simulated_machine import SimulatorError, simulated_machine
from servo_ctrl.metrology.circles import analyse_circles
from servo_ctrl.recording.reader import load_recording
from studies.feng_2015.circles import summary

ROOT = Path(__file__).parents[2]
EMPS_DATA = ROOT.parent / "shared" / "data" / "emps"
PROCESS_TIMEOUT_S = 800.0  # each of 100,000 turns in lockstep waits for others that want the processors


def servo_ctrl(*arguments: str) -> str:
    """Run the console script as a user would, without a terminal; return what it printed."""
    command = [str(Path(sys.executable).with_name("servo-ctrl")), *arguments]
    done = subprocess.run(
        command,
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=PROCESS_TIMEOUT_S,
        check=False,
        env={**os.environ, "COLUMNS": "120"},
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


@pytest.mark.skipif(not EMPS_DATA.is_dir(), reason=f"the real recordings are not at {EMPS_DATA}")
def test_the_simulated_emps_axis_comes_as_close_to_the_real_one_as_the_published_model(
    tmp_path: Path,
) -> None:
    figures_file = tmp_path / "emps.json"
    servo_ctrl(
        "experiment", "emps", "--data", str(EMPS_DATA), "--out", str(tmp_path), "--json", str(figures_file)
    )
    figures = json.loads(figures_file.read_text())
    for record, published_percent in (("train", 5.85), ("pulses", 8.94)):
        assert figures[record]["force_error_with_start_percent"] < published_percent
        assert figures[record]["force_error_percent"] > 1.0  # the rigid model lacks real physics
        assert figures[record]["position_rms_um"] < 5.0
        assert (tmp_path / f"{record}.png").stat().st_size > 10_000


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """What the demo printed, and its folder."""
    out = tmp_path_factory.mktemp("demo")
    return servo_ctrl("demo", "--out", str(out)), out


def test_the_demo_prints_the_indicators_and_writes_pictures_and_recording(demo: tuple[str, Path]) -> None:
    printed, out = demo
    for expected in ("500", "1000", "2000", "3000", "contour peak", "RMS e", "cycles/s"):
        assert expected in printed
    assert (out / "contour.png").stat().st_size > 10_000
    assert (out / "reversals.png").stat().st_size > 10_000
    (recording,) = (out / "recordings").iterdir()
    assert list(recording.glob("part-*.parquet"))
    assert (out / "recording").resolve() == recording.resolve()  # as README's next command calls it


def test_the_uncompensated_table_makes_the_published_errors(demo: tuple[str, Path]) -> None:
    (recording,) = (demo[1] / "recordings").iterdir()
    figures = summary(analyse_circles(load_recording(recording), load_machine(XY_TABLE).monitoring.window_s))
    errors = figures["published_x_relative_errors_percent"]
    assert sum(len(row) for row in errors.values()) == 16
    assert figures["relative_error_rms_percent"] < 15.0
    assert abs(figures["relative_error_largest_percent"]) < 30.0


def test_the_study_of_circles_compares_with_what_was_published(tmp_path: Path) -> None:
    machine = tmp_path / "machine"
    write_controller(machine, text_of(XY_TABLE / "controller.toml"))
    write_plant(machine, text_of(XY_TABLE / "plant.toml"))
    program = Path("programs", "circles.toml")
    _, to_the_start, *steps = (XY_TABLE / program).read_text(encoding="utf-8").split("[[step]]")
    (fastest,) = (step for step in steps if '"F 3000"' in step)
    (machine / program).parent.mkdir()
    (machine / program).write_text(f"[[step]]{to_the_start}[[step]]{fastest}", encoding="utf-8")
    json_file = tmp_path / "circles.json"
    printed = servo_ctrl(
        *("experiment", "circles", "--machine", str(machine)),
        *("--out", str(tmp_path), "--json", str(json_file)),
    )
    figures = json.loads(json_file.read_text())
    (errors,) = figures["published_x_relative_errors_percent"].values()
    assert all(abs(error) < 30.0 for error in errors.values())
    assert "Feng et al. 2015" in printed
    assert "the 4 relative errors of x" in printed
    assert (tmp_path / "contour.png").stat().st_size > 10_000


def test_a_machine_without_a_plant_gives_one_clear_line() -> None:
    async def start() -> None:
        async with simulated_machine(ROOT / "docs", "lockstep"):
            pass

    with pytest.raises(SimulatorError, match=r"hil-sim did not start.*plant\.toml"):
        asyncio.run(start())


PARENT = """
import asyncio, sys
from pathlib import Path
from servo_ctrl.config.load import load_machine
from servo_ctrl.hil_rig.simulated_machine import simulated_machine

async def hold():
    async with simulated_machine(Path(sys.argv[1]), "lockstep") as bus:
        print(bus, flush=True)
        await asyncio.sleep(60.0)

asyncio.run(hold())
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs Linux (prctl)")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_hub_and_simulator_end_with_a_killed_parent(number: signal.Signals) -> None:
    command = [sys.executable, "-c", PARENT, str(ROOT / "machines" / "xy_table")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        channel = parent.stdout.readline().strip().partition(":")[2]
        can.Bus(interface="localcan", channel=channel).shutdown()
        parent.send_signal(number)
    deadline_s = time.monotonic() + 10.0
    with contextlib.suppress(can.CanError):
        while True:
            can.Bus(interface="localcan", channel=channel).shutdown()
            assert time.monotonic() < deadline_s, "the hub is still there"
            time.sleep(0.05)
