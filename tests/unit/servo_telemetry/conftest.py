"""A Mosquitto broker and a desk for the tests of the MQTT link."""

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
from fake_desk import FakeDesk
from local_bench import LocalBench
from mosquitto import Mosquitto


@pytest_asyncio.fixture
async def broker(tmp_path: Path) -> AsyncIterator[Mosquitto]:
    async with Mosquitto(tmp_path) as made:
        yield made


@pytest.fixture
def desk() -> FakeDesk:
    return FakeDesk()


@pytest.fixture
async def bench() -> LocalBench:
    """The local socket's server."""
    return LocalBench()


@pytest.fixture
async def path(bench: LocalBench) -> AsyncIterator[Path]:
    """Its socket."""
    async with bench.server.serving() as socket:
        yield socket
