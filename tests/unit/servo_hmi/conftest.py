"""A page of a stub machine in this process."""

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from nicegui.testing.user_simulation import user_simulation
from page_in_process import PageInProcess

from servo_ctrl.hmi.shell.parts import configure_elements


@pytest.fixture
async def shown_page(tmp_path: Path) -> AsyncIterator[PageInProcess]:
    async with user_simulation() as user:
        configure_elements()
        yield PageInProcess(user, tmp_path)
