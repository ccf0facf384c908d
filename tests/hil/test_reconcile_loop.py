"""The loop by one command: record, diagnose, next experiment, until the diagnosis is decided."""

import json
import os
import signal
from pathlib import Path

import pytest
from concealed_effects import CONCEALED
from concealed_machine import motion, write_machine

from reconcile.design.program import PROGRAM_FILE
from reconcile.errors import ReconcileError
from reconcile.loop.loop import STOPPED, LoopOptions, run_loop
from servo_ctrl.daemon.run.report import Progress

EFFECT = "stribeck_friction"


def machine_with(folder: Path, sections: str = "") -> Path:
    """At 500 Hz: enough for a filter of 60 Hz, in half the cycles."""
    machine = write_machine(folder, {"x": sections.replace("NAME", "x")}, motion()[:, None])
    file = machine / "controller.toml"
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("sync_period_us = 1000", "sync_period_us = 2000"), encoding="utf-8")
    return machine


def loop_options(tmp_path: Path, program: str, **more: object) -> LoopOptions:
    machine = machine_with(tmp_path / "machine", CONCEALED[EFFECT].sections)
    nominal = machine_with(tmp_path / "nominal")
    (machine / "first.toml").write_text(program, encoding="utf-8")
    return LoopOptions(
        machine, nominal / "plant.toml", tmp_path / "out", program=machine / "first.toml", **more
    )


PRODUCTION = """
[[step]]
kind = "sine"
axis = "x"
amplitude_mm = 10.0
frequency_hz = 1.0
cycles = 2.0
ramp_s = 0.5
"""


def test_loop_requests_motions_until_the_concealed_effect_is_named(tmp_path: Path) -> None:
    """Production alone does not show the effect; the requested motion does, and the daemon ran it."""
    done = run_loop(loop_options(tmp_path, PRODUCTION, most_recordings=2))
    log = json.loads(done.log.read_text(encoding="utf-8"))
    assert log["ended"] == done.why
    assert len(log["rounds"]) == len(done.rounds) >= 2
    first = log["rounds"][0]
    assert first["next_experiment"]["program"] == PROGRAM_FILE
    assert log["rounds"][1]["program"] == str(tmp_path / "out" / "round_1" / PROGRAM_FILE)
    assert EFFECT not in {finding["effect"] for finding in first["findings"]}
    assert EFFECT in {finding["effect"] for finding in log["rounds"][-1]["findings"]}


def test_ctrl_c_stops_the_axes_and_ends_the_loop(tmp_path: Path) -> None:
    sent: list[str] = []

    def interrupt(progress: Progress) -> None:
        if progress.step >= 0 and not sent:
            sent.append("SIGINT")
            os.kill(os.getpid(), signal.SIGINT)

    done = run_loop(loop_options(tmp_path, PRODUCTION), on_progress=interrupt)
    assert done.why == STOPPED
    assert json.loads(done.log.read_text(encoding="utf-8"))["rounds"][-1]["stopped"] == "stopped by SIGINT"


def test_axis_without_reference_is_refused_before_anything_moves(tmp_path: Path) -> None:
    options = loop_options(tmp_path, PRODUCTION)
    file = options.machine / "controller.toml"
    file.write_text(
        file.read_text(encoding="utf-8").replace("homing_method = 37", "homing_method = 0"), encoding="utf-8"
    )
    with pytest.raises(ReconcileError, match="not referenced"):
        run_loop(options)
    assert not options.out.exists()


def test_first_motion_beyond_the_limits_is_refused_before_anything_moves(tmp_path: Path) -> None:
    with pytest.raises(ReconcileError, match="beyond the limit"):
        run_loop(loop_options(tmp_path, PRODUCTION.replace("10.0", "60.0")))
    assert not (tmp_path / "out" / "round_1").exists()
