from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Stub
    from playwright.sync_api import Page


@pytest.mark.parametrize("width", [360, 1280])
def test_stop_is_in_sight_at_every_width_and_needs_no_control(
    visit: Callable[..., Page], stub: Stub, width: int
) -> None:
    page = visit("/", width=width)
    stop = page.get_by_test_id("stop")
    expect(stop).to_be_in_viewport(ratio=1.0)
    page.mouse.wheel(0, 2000)
    expect(stop).to_be_in_viewport(ratio=1.0)
    stop.click()
    expect(page.locator("#bench-stop-failed")).to_be_hidden()
    page.keyboard.press("Escape")
    page.wait_for_timeout(300)
    assert stub.commands() == ["quick_stop", "quick_stop"]
