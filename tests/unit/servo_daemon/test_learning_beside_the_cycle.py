"""Learning in real time: planning and files run in a thread, and requests may come in between."""

import asyncio
import contextlib
import threading
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from learning_stand import STROKES, LearningStand, short_learning

from servo_ctrl.commands.command import Command, CommandRequest, Refusal
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage
from servo_ctrl.learned.stroke_journal import StrokeJournal

START_X = CommandRequest(Command.START_LEARNING, "x")


@contextlib.asynccontextmanager
async def at_work(made: LearningStand) -> AsyncIterator[None]:
    """The worker of the stand runs."""
    task = asyncio.create_task(made.services.worker.run())
    try:
        async with asyncio.timeout(60.0):
            yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


@pytest.fixture
def stand(machine_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> LearningStand:
    short_learning(monkeypatch)
    return LearningStand(machine_file, tmp_path / "learned", lockstep=False)


@pytest.fixture
def slow_disk(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """No stroke is in the journal before this is set."""
    released = threading.Event()
    append = StrokeJournal.append

    def slowly(self: StrokeJournal, *entry: object) -> None:
        assert released.wait(30.0)
        append(self, *entry)  # type: ignore[arg-type]  # what it was called with

    monkeypatch.setattr(StrokeJournal, "append", slowly)
    return released


async def test_nothing_is_planned_or_written_in_the_thread_of_the_cycle(stand: LearningStand) -> None:
    async with at_work(stand):
        assert stand.handler.execute(START_X).accepted
        assert stand.machine.program is None, "planned later"
        for _ in STROKES:
            await stand.services.worker.finish()
            stand.play()
        assert stand.status.learning.state is LearningState.RUNNING
        await stand.services.worker.finish()
    assert stand.status.learning.state is LearningState.DONE
    assert stand.status.axes[0].version == 1
    assert stand.pulse("x").enabled


async def test_abort_while_the_disk_is_slow_leaves_nothing_behind(
    stand: LearningStand, slow_disk: threading.Event, tmp_path: Path
) -> None:
    async with at_work(stand):
        stand.handler.execute(START_X)
        await stand.services.worker.finish()
        stand.play()
        await asyncio.sleep(0)
        assert stand.handler.execute(CommandRequest(Command.ABORT_LEARNING)).accepted
        assert stand.status.learning.state is LearningState.ABORTED
        slow_disk.set()
        await stand.services.worker.finish()
    assert stand.status.learning.state is LearningState.ABORTED
    assert stand.machine.stage is Stage.READY
    assert not (tmp_path / "learned" / "x" / "journal.jsonl").exists()


async def test_new_start_right_after_an_abort_is_a_new_run(
    stand: LearningStand, slow_disk: threading.Event
) -> None:
    async with at_work(stand):
        stand.handler.execute(START_X)
        await stand.services.worker.finish()
        stand.play()
        stand.handler.execute(CommandRequest(Command.ABORT_LEARNING))
        assert stand.handler.execute(START_X).accepted
        slow_disk.set()
        for number in range(len(STROKES)):
            await stand.services.worker.finish()
            learning = stand.status.learning
            assert learning.planned
            assert learning.strokes_done == number
            stand.play()
        await stand.services.worker.finish()
    assert stand.status.learning.state is LearningState.DONE
    assert stand.services.learning.job.outcomes[0].resumed == 0


async def test_pause_while_a_stroke_is_being_evaluated_comes_before_the_next(
    stand: LearningStand, slow_disk: threading.Event
) -> None:
    async with at_work(stand):
        stand.handler.execute(START_X)
        await stand.services.worker.finish()
        stand.play()
        assert stand.handler.execute(CommandRequest(Command.PAUSE_LEARNING)).accepted
        slow_disk.set()
        await stand.services.worker.finish()
        assert stand.status.learning.state is LearningState.PAUSED
        assert stand.machine.stage is Stage.READY
        assert stand.handler.execute(CommandRequest(Command.RESUME_LEARNING)).accepted
        await stand.services.worker.finish()
        assert stand.machine.stage is Stage.RUNNING


async def test_machine_that_stops_between_two_strokes_is_not_moved_again(
    stand: LearningStand, slow_disk: threading.Event
) -> None:
    async with at_work(stand):
        stand.handler.execute(START_X)
        await stand.services.worker.finish()
        stand.play()
        stand.stop("bus down")
        slow_disk.set()
        await stand.services.worker.finish()
    assert (stand.status.learning.state, stand.status.learning.reason) == (LearningState.FAILED, "bus down")
    assert stand.machine.stage is Stage.STOPPING
    assert not stand.pulse("x").enabled


async def test_roll_back_that_fails_later_is_an_event(stand: LearningStand, tmp_path: Path) -> None:
    async with at_work(stand):
        stand.handler.execute(START_X)
        for _ in STROKES:
            await stand.services.worker.finish()
            stand.play()
        await stand.services.worker.finish()
        active = tmp_path / "learned" / "x" / "active.json"
        active.unlink()
        active.mkdir()  # cannot be replaced by a file
        assert stand.handler.execute(CommandRequest(Command.ROLL_BACK, "x")).accepted
        await stand.services.worker.finish()
    assert "cannot be" in stand.machine.notes[-1]
    assert stand.status.axes[0].version == 1


async def test_program_is_not_started_while_strokes_are_made(stand: LearningStand) -> None:
    async with at_work(stand):
        stand.handler.execute(START_X)
        verdict = stand.handler.execute(CommandRequest(Command.START_PROGRAM))
        assert (verdict.refusal, verdict.reason) == (
            Refusal.WRONG_STATE,
            "an axis is learning; pause or abort it first",
        )
        await stand.services.worker.finish()
