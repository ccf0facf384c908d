"""Runs work that takes longer than a period: planning, evaluating, writing files.

In real time the work runs in a thread, one piece after the other, while the cycle continues. In lockstep it
runs within the cycle, so that a repeated run takes the same cycles: simulated time waits for the work.
"""

import asyncio
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from kernels.thread_priority import lower_priority
from servo_ctrl.errors import ServoCtrlError

T = TypeVar("T")


class _Work(NamedTuple):
    """A piece of work. The thread of the cycle calls `then` or `failed`."""

    work: Callable[[], Any]
    then: Callable[[Any], None]
    failed: Callable[[str], None]


class BackgroundWorker:
    """Runs pieces of work one after the other, in the order of their requests."""

    def __init__(self, *, lockstep: bool) -> None:
        self._lockstep = lockstep
        self._queue: asyncio.Queue[_Work] = asyncio.Queue()

    def do(self, work: Callable[[], T], then: Callable[[T], None], failed: Callable[[str], None]) -> None:
        """Run `work`, then pass its result to `then`, or the text of its ServoCtrlError to `failed`."""
        piece = _Work(work, then, failed)
        if self._lockstep:
            _conclude(piece, _attempt(piece))
        else:
            self._queue.put_nowait(piece)

    async def run(self) -> None:
        """Run the queued work until cancelled. Exceptions other than ServoCtrlError propagate."""
        while True:
            piece = await self._queue.get()
            try:
                _conclude(piece, await asyncio.to_thread(_attempt_in_thread, piece))
            finally:
                self._queue.task_done()

    async def finish(self) -> None:
        """Wait until all work is done."""
        await self._queue.join()


def _attempt_in_thread(piece: _Work) -> Any:
    lower_priority()
    return _attempt(piece)


def _attempt(piece: _Work) -> Any:
    try:
        return piece.work()
    except ServoCtrlError as error:
        return error


def _conclude(piece: _Work, outcome: Any) -> None:
    if isinstance(outcome, ServoCtrlError):
        piece.failed(str(outcome))
    else:
        piece.then(outcome)
