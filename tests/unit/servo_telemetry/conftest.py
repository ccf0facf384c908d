"""A Mosquitto broker and a command handler for the tests of the MQTT link."""

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
from fake_command_handler import FakeCommandHandler
from local_socket_bench import LocalSocketBench
from mosquitto import Mosquitto


@pytest_asyncio.fixture
async def broker(tmp_path: Path) -> AsyncIterator[Mosquitto]:
    async with Mosquitto(tmp_path) as made:
        yield made


@pytest.fixture
def handler() -> FakeCommandHandler:
    return FakeCommandHandler()


@pytest.fixture
async def bench() -> LocalSocketBench:
    """The local socket's server."""
    return LocalSocketBench()


@pytest.fixture
async def path(bench: LocalSocketBench) -> AsyncIterator[Path]:
    """Its socket."""
    async with bench.server.serving() as socket:
        yield socket
