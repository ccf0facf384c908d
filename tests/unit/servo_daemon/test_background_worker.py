"""Work beside the cycle: at once in lockstep, in order and in a thread in real time."""

import asyncio
import threading

import pytest

from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.errors import ServoCtrlError


def fails() -> None:
    raise ServoCtrlError("the disk is full")


def test_in_lockstep_work_is_done_before_the_call_returns() -> None:
    done: list[object] = []
    worker = BackgroundWorker(lockstep=True)
    worker.do(threading.current_thread, done.append, done.append)
    worker.do(fails, done.append, done.append)
    assert done == [threading.current_thread(), "the disk is full"]


async def test_in_real_time_work_runs_in_a_thread_in_order_and_results_arrive_in_the_event_loop() -> None:
    done: list[object] = []
    worker = BackgroundWorker(lockstep=False)
    ours = threading.current_thread()
    release = threading.Event()

    def slow() -> bool:
        return release.wait(10.0) and threading.current_thread() is not ours

    worker.do(slow, lambda apart: done.append((apart, threading.current_thread() is ours)), done.append)
    worker.do(fails, done.append, done.append)
    worker.do(lambda: "last", done.append, done.append)
    task = asyncio.create_task(worker.run())
    async with asyncio.timeout(10.0):
        await asyncio.sleep(0)
        assert done == [], "the caller has gone on"
        release.set()
        await worker.finish()
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert done == [(True, True), "the disk is full", "last"]


async def test_finish_also_waits_for_work_that_finished_work_requested() -> None:
    done: list[str] = []
    worker = BackgroundWorker(lockstep=False)
    worker.do(
        lambda: "first",
        lambda first: worker.do(lambda: f"{first}, second", done.append, done.append),
        done.append,
    )
    task = asyncio.create_task(worker.run())
    async with asyncio.timeout(10.0):
        await worker.finish()
    task.cancel()
    assert done == ["first, second"]


async def test_an_exception_in_the_work_is_raised() -> None:
    worker = BackgroundWorker(lockstep=False)
    worker.do(lambda: 1 // 0, print, print)
    with pytest.raises(ZeroDivisionError):
        async with asyncio.timeout(10.0):
            await worker.run()
