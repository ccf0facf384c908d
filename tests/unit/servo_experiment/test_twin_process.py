"""A program beside ours that is bounded, and ends with us."""

from __future__ import annotations

import os
import select
import subprocess
import sys

import pytest

from servo_ctrl.experiment.twin_process import TwinError, run_twin


def test_what_it_prints_is_told_line_by_line() -> None:
    told: list[str] = []
    run_twin("this", [], 30.0, told.append)  # the Zen of Python
    assert told[0].startswith("The Zen of Python")
    assert len(told) == 21


def test_a_program_that_fails_is_quoted() -> None:
    with pytest.raises(TwinError, match=r"ended with 1: .*No module named no_such_module"):
        run_twin("no_such_module", [], 30.0)


def test_a_program_that_takes_too_long_is_ended() -> None:
    with pytest.raises(TwinError, match=r"did not end within 0\.2 s"):
        run_twin("timeit", ["-n", "1", "-r", "1", "import time; time.sleep(60)"], 0.2)


def test_a_program_does_not_outlive_an_interrupt() -> None:
    def interrupted(_line: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_twin(
            "timeit",
            ["-n", "1", "-r", "1", "print(1, flush=True); import time; time.sleep(60)"],
            30.0,
            interrupted,
        )


def test_a_program_does_not_outlive_us_where_we_are_killed() -> None:
    begun = "import os, time; print(os.getpid(), flush=True); time.sleep(60)"
    ours = (
        "from servo_ctrl.experiment.twin_process import run_twin;"
        f"run_twin('timeit', ['-n', '1', '-r', '1', {begun!r}], 60.0, lambda line: print(line, flush=True))"
    )
    with subprocess.Popen([sys.executable, "-c", ours], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        twin = os.pidfd_open(int(parent.stdout.readline()))
        parent.kill()
    try:
        assert select.select([twin], [], [], 10.0)[0], "it goes on"
    finally:
        os.close(twin)
