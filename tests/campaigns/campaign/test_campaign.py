"""A short campaign: every fault once, and defects of the machine that the campaign must detect."""

from __future__ import annotations

import os
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from servo_ctrl.axis import fault_policy
from servo_ctrl.axis.fault_policy import Event, Reaction
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.event_log import EventLog
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.files import whole_file
from servo_ctrl.recording.recorder import Recorder
from tests.campaigns.campaign import faults, worker
from tests.campaigns.campaign.closing import while_closing
from tests.campaigns.campaign.draw import draw

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.campaigns.campaign.journal import Result

KILLED = faults.named("killed while writing")


def seed_of(fault: str, states: tuple[str, ...] = (), pacing: str = "") -> int:
    """Return the first seed with this fault, without a second fault or another run."""
    for seed in range(20_000):
        plan = draw(seed)
        single = plan.second is None and not plan.next_run
        wanted = plan.fault.name == fault and (not states or plan.state in states)
        if single and wanted and pacing in {"", plan.pacing}:
            return seed
    raise AssertionError(f"nothing draws {fault} in {states}")


def cheap_states(name: str) -> tuple[str, ...]:
    """Return the states of a fault with short runs, in motion if possible."""
    fault = faults.named(name)
    return tuple(state for state in fault.states if state in {"jogging", "ready"}) or fault.states


@pytest.mark.parametrize("name", [fault.name for fault in faults.ALL])
def test_fault_is_reacted_to_as_documented(name: str) -> None:
    assert worker.result(seed_of(name, cheap_states(name))).violations == ()


def test_run_is_the_same_every_time() -> None:
    seed = seed_of("inputs late", ("jogging",))
    first, second = (worker.run_seed(seed)[0] for _ in range(2))
    assert first.frames == second.frames
    for one, other in zip(first.truth, second.truth, strict=True):
        np.testing.assert_array_equal(one, other)
    assert (first.injected, first.reported, first.ticks) == (second.injected, second.reported, second.ticks)


def found_by(result: Result, words: str) -> bool:
    return any(words in text for text in result.violations)


def test_machine_that_ignores_emergency_messages_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    table = {stage: dict(row) for stage, row in fault_policy.REACTIONS.items()}
    for stage in (Stage.READY, Stage.RUNNING):
        table[stage][Event.EMCY] = Reaction.NONE
    monkeypatch.setattr(fault_policy, "REACTIONS", table)
    result = worker.result(seed_of("emergency message", ("jogging",)))
    assert found_by(result, "hold")


def test_machine_that_brakes_ten_cycles_late_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    event = MachineController.event
    waiting: list[tuple[int, tuple[Any, ...]]] = []

    def slow(machine: Any, *what: Any) -> None:
        waiting.append((machine._cycle + 10, (machine, *what)))

    tick = MachineController.tick

    def ticked(machine: Any, cycle: int, elapsed: int, inputs: Any) -> Any:
        while waiting and waiting[0][0] <= cycle:
            event(*waiting.pop(0)[1])
        return tick(machine, cycle, elapsed, inputs)

    monkeypatch.setattr(MachineController, "event", slow)
    monkeypatch.setattr(MachineController, "tick", ticked)
    result = worker.result(seed_of("another controller", ("jogging",)))
    assert found_by(result, "quick stop after")


def test_machine_that_forgets_events_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(EventLog, "add", lambda _log, _text, _cycle: None)
    result = worker.result(seed_of("bus warning", ("jogging",)))
    assert found_by(result, "not reported")


def test_recorder_that_loses_the_last_rows_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    close = Recorder.close

    def hasty(recorder: Recorder, header: dict[str, Any]) -> None:
        recorder._row = 0
        close(recorder, header)

    monkeypatch.setattr(Recorder, "close", hasty)
    result = worker.result(seed_of("foreign frames", ("jogging",)))
    assert found_by(result, "rows of")


def test_cancelled_run_ticks_no_more_once_its_recording_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    # a disk that is faster than the pending frames
    while_closing(monkeypatch, lambda: None, first=False)
    seeds = [seed_of("task cancelled", (state,), "lockstep") for state in ("jogging", "ready", "running")]
    assert [worker.result(seed).violations for seed in seeds] == [(), (), ()]


def in_place(path: Path, write: Callable[[Path], object]) -> None:
    """Write like `write_whole`, but so that a kill may leave half of the file."""
    write(path)
    text = path.read_bytes()
    path.write_bytes(text[: len(text) // 2])
    with path.open("rb") as file:
        os.fsync(file.fileno())
    path.write_bytes(text)


def test_store_that_writes_in_place_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(whole_file, "write_whole", in_place)
    seeds = (seed for seed in range(20_000) if draw(seed)[1:4] == (KILLED, "learning", "lockstep"))
    for seed in islice(seeds, 25):
        if found_by(worker.result(seed), "is damaged"):
            return
    pytest.fail("no kill has left half a file")


def test_an_exception_in_a_run_is_a_finding_and_does_not_end_the_campaign(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def broken(_folder: object) -> None:
        raise RuntimeError("planted")

    monkeypatch.setattr(worker, "run", broken)
    assert found_by(worker.result(0), "the run broke")
