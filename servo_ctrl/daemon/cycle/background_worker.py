"""Where work is done that takes longer than a period: planning, evaluating, writing files.

In real time in a thread, one piece after the other, and the cycle goes on meanwhile. In lockstep at once,
within the cycle, so that the same run takes the same cycles every time: simulated time waits.
"""

import asyncio
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from servo_ctrl.daemon.cycle.realtime import step_back
from servo_ctrl.errors import ServoCtrlError

Failed = Callable[[str], None]

T = TypeVar("T")


class _Work(NamedTuple):
    """A piece of work and who is told; `then` and `failed` are called in the thread of the cycle."""

    work: Callable[[], Any]
    then: Callable[[Any], None]
    failed: Failed


class BackgroundWorker:
    """Does one piece of work after the other, in the order in which they came."""

    def __init__(self, *, lockstep: bool) -> None:
        self._lockstep = lockstep
        self._queue: asyncio.Queue[_Work] = asyncio.Queue()

    def do(self, work: Callable[[], T], then: Callable[[T], None], failed: Failed) -> None:
        """Do `work`; `then` takes its result, `failed` the reason where it raised a ServoCtrlError."""
        piece = _Work(work, then, failed)
        if self._lockstep:
            _conclude(piece, _attempt(piece))
        else:
            self._queue.put_nowait(piece)

    async def run(self) -> None:
        """Do what comes, until cancelled. A bug in the work comes out here."""
        while True:
            piece = await self._queue.get()
            try:
                _conclude(piece, await asyncio.to_thread(_beside, piece))
            finally:
                self._queue.task_done()

    async def finish(self) -> None:
        """Until all that was asked for is done."""
        await self._queue.join()


def _beside(piece: _Work) -> Any:
    """In a thread of its own."""
    step_back()
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
