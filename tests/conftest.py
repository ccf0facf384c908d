"""Guards for every test: an async test that leaves tasks behind fails."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest
import pytest_asyncio

if TYPE_CHECKING:
    from collections.abc import AsyncIterator


@pytest_asyncio.fixture
async def leaked_tasks() -> AsyncIterator[None]:
    """Fails when tasks of the test outlive it."""
    yield
    left = [task for task in asyncio.all_tasks() if task is not asyncio.current_task() and not task.done()]
    assert not left, f"leaked tasks: {left}"


@pytest.fixture(autouse=True)
def guarded(request: pytest.FixtureRequest) -> None:
    """Puts `leaked_tasks` around every async test."""
    if request.node.get_closest_marker("asyncio") is not None:
        request.getfixturevalue("leaked_tasks")
