"""A loop stays awake for a moment after a burst, and only where no other program wants the processor."""

import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from can_frames import awake_loop
from can_frames.awake_loop import AWAKE_S, LOOK_S, AwakeLoop, is_running, running_programs


class Loop:
    """What is ready in a loop, with a clock that every look at the bus moves by a tenth of the wait."""

    def __init__(self, running: Callable[[], int | None], peers: tuple[int, ...] = ()) -> None:
        self.now_s = 100.0
        self.answer_s = 1e9
        """When the answer comes."""
        self.ready: list[Callable[[], None]] = []
        self.peer_runs = False
        as_loop: Any = self
        self.awake = AwakeLoop(as_loop, self.look, lambda: peers, running, self.runs, lambda: self.now_s)

    def call_soon(self, callback: Callable[[], None]) -> None:
        self.ready.append(callback)

    def runs(self, _pid: int) -> bool:
        return self.peer_runs

    def look(self) -> bool:
        self.now_s += 0.1 * AWAKE_S
        came = self.now_s > self.answer_s
        if came:
            self.answer_s = 1e9
            self.awake.on_burst()
        return came

    def turn(self) -> bool:
        """One turn of the loop; return whether the next one polls without sleeping."""
        ready, self.ready = self.ready, []
        for callback in ready:
            callback()
        return bool(self.ready)


@pytest.fixture(autouse=True)
def two_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: {0, 1})


def test_a_loop_looks_for_the_answer_and_sleeps_where_none_comes() -> None:
    loop = Loop(lambda: 1)
    loop.awake.on_burst()
    loop.awake.on_burst()
    assert len(loop.ready) == 1  # it turns once, however many bursts came
    loop.answer_s = loop.now_s + 0.9 * AWAKE_S
    assert loop.turn()  # what else is ready has its turn after each answer
    began_s = loop.now_s
    assert not loop.turn()
    assert loop.now_s - began_s == pytest.approx(AWAKE_S, rel=0.11)
    loop.awake.on_burst()
    assert len(loop.ready) == 1


def test_it_begins_beside_a_free_processor_and_goes_on_until_a_third_program_runs() -> None:
    running = iter((2, 1, 2, 3, 2, 1))
    loop = Loop(lambda: next(running))
    for awake in (False, True, True, False, False, True):
        loop.now_s += 1.1 * LOOK_S
        loop.turn()
        loop.awake.on_burst()
        assert bool(loop.ready) is awake


@pytest.mark.parametrize(
    ("running", "peer_runs", "awake"),
    [(1, False, True), (2, True, True), (2, False, False), (3, True, False)],
)
def test_it_stays_awake_where_both_sides_have_a_processor(running: int, peer_runs: bool, awake: bool) -> None:
    loop = Loop(lambda: running, peers=(41,))
    loop.peer_runs = peer_runs
    loop.awake.on_burst()
    assert bool(loop.ready) is awake


def test_two_sides_of_one_process_do_not_wait_for_each_other() -> None:
    loop = Loop(lambda: 1, peers=(os.getpid(),))
    loop.awake.on_burst()
    assert loop.ready == []


def test_a_process_runs_or_sleeps_as_the_system_says() -> None:
    assert is_running(os.getpid())
    assert not is_running(0)
    with subprocess.Popen(["cat"], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as sleeping:
        assert sleeping.stdin
        assert sleeping.stdout
        sleeping.stdin.write(b"\n")
        sleeping.stdin.flush()
        sleeping.stdout.read(1)  # it has begun, and waits for more
        while is_running(sleeping.pid):
            os.sched_yield()


def test_it_sleeps_where_the_system_does_not_say_what_runs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(awake_loop, "LOAD", tmp_path / "loadavg")
    assert running_programs() is None
    (tmp_path / "loadavg").write_text("0.52 0.58 0.59 2/345 6789\n")
    assert running_programs() == 2
    loop = Loop(lambda: None)
    loop.awake.on_burst()
    assert loop.ready == []
