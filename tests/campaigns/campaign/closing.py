"""Runs an action while the daemon closes a recording, which it does in a thread."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    import pytest


def while_closing(monkeypatch: pytest.MonkeyPatch, act: Callable[[], None], *, first: bool) -> None:
    """Call `act` before the recording is closed, or after it with `first` false; the loop then runs on."""
    to_thread = asyncio.to_thread

    async def closing(work: Callable[..., Any], *arguments: Any) -> Any:
        if work.__name__ != "_close":
            return await to_thread(work, *arguments)
        result = None if first else work(*arguments)
        act()
        for _ in range(5):
            await asyncio.sleep(0)
        return work(*arguments) if first else result

    monkeypatch.setattr(asyncio, "to_thread", closing)
