"""For every test: no task is left behind, and no property fails for having taken long on a busy machine."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest
import pytest_asyncio
from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")


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
