"""What happens while a recording is closed, which the daemon does in a thread."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    import pytest


def while_closing(monkeypatch: pytest.MonkeyPatch, happen: Callable[[], None], *, first: bool) -> None:
    """`happen`, seen by those that still listen, before the recording is closed, or after it."""
    to_thread = asyncio.to_thread

    async def closing(work: Callable[..., Any], *what: Any) -> Any:
        if work.__name__ != "_close":
            return await to_thread(work, *what)
        done = None if first else work(*what)
        happen()
        for _ in range(5):
            await asyncio.sleep(0)
        return work(*what) if first else done

    monkeypatch.setattr(asyncio, "to_thread", closing)
