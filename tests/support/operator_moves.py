"""What an operator does with motion on a page: steps, a part program and its mending, a circle."""

import contextlib
import re
from collections.abc import Callable

import pytest
from live_page import go
from playwright.sync_api import Page, expect

LIMIT_MS = 240_000
PART = """G21 G90 G64 P0.02
G0 X0 Y0
G1 X4 F300
Y3
X0
G0 Y0
M2
"""


def start_the_program(page: Page) -> None:
    """A click is lost with a connection that breaks at this moment: an operator clicks again."""
    start, stage = page.get_by_test_id("start"), page.get_by_test_id("stage")
    for limit_ms in (60_000, LIMIT_MS):
        expect(start).to_be_enabled(timeout=LIMIT_MS)
        start.click()
        with contextlib.suppress(AssertionError):
            expect(stage).to_contain_text("Running", timeout=limit_ms)
            return
    pytest.fail("the program does not start")


def run_circle(page: Page, url: str) -> None:
    go(page, f"{url}/motion")
    start_the_program(page)
    expect(page.get_by_test_id("program-step")).to_contain_text("circle", timeout=LIMIT_MS)
    expect(page.get_by_test_id("stage")).to_contain_text("Ready", timeout=LIMIT_MS)


def expect_x_at_zero(page: Page, url: str) -> None:
    """After X-2 in G54, whose zero is at 2 mm."""
    go(page, url)
    near_zero = re.compile("^\N{MINUS SIGN}?0[.]00")
    expect(page.get_by_test_id("position-x")).to_have_text(near_zero, timeout=LIMIT_MS)


def step_and_touch_off(page: Page) -> None:
    """Two steps of 1 mm by button and key; there is 0 in G54."""
    expect(page.get_by_test_id("step-x-plus")).to_be_enabled(timeout=LIMIT_MS)
    page.get_by_test_id("jog-step").get_by_role("button", name="1", exact=True).click()
    page.get_by_test_id("step-x-plus").click()
    expect(page.get_by_test_id("position-x")).to_contain_text("1.0", timeout=LIMIT_MS)
    expect(page.get_by_test_id("stage")).to_contain_text("Ready", timeout=LIMIT_MS)
    page.locator("h2").first.click()
    page.keyboard.press("Shift+ArrowRight")
    expect(page.get_by_test_id("position-x")).to_contain_text("2.0", timeout=LIMIT_MS)
    expect(page.get_by_test_id("touch-off-x")).to_be_enabled(timeout=LIMIT_MS)
    page.get_by_test_id("touch-off-x").click()
    expect(page.get_by_test_id("offset-position-x")).to_contain_text("X 0.0000 mm in G54", timeout=LIMIT_MS)


def mend_and_load_the_part(page: Page) -> None:
    page.get_by_test_id("program-choice").click()
    page.get_by_role("option", name="part.ngc").click()
    verdict = page.get_by_test_id("program-verdict")
    expect(verdict).to_contain_text("line 3: axis x: position", timeout=LIMIT_MS)
    text = page.get_by_test_id("program-text")
    text.fill(PART)
    text.press("Tab")
    expect(verdict).to_contain_text("within the limits")
    page.get_by_test_id("load-program").click()
    expect(page.get_by_test_id("program-name")).to_have_text("part.ngc", timeout=LIMIT_MS)


def run_the_part(page: Page, picture: Callable[[Page, str], None]) -> None:
    """With an override, held and resumed, from a line, and a line of its own."""
    stage, step = page.get_by_test_id("stage"), page.get_by_test_id("program-step")
    page.get_by_test_id("feed-override").get_by_role("button", name="50", exact=True).click()
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("line-under-way")).to_contain_text("▶ 3", timeout=LIMIT_MS)
    page.get_by_test_id("hold").click()
    expect(stage).to_contain_text("Held", timeout=LIMIT_MS)
    expect(step).to_contain_text('held in step 2 "lines 3-6"')  # line 3, or 4 where the click came late
    picture(page, "operator_2_held")
    page.get_by_test_id("feed-override").get_by_role("button", name="100", exact=True).click()
    page.get_by_test_id("resume").click()
    expect(stage).to_contain_text("Ready", timeout=LIMIT_MS)

    page.get_by_test_id("first-line").fill("5")
    page.get_by_test_id("first-line").press("Tab")
    expect(page.get_by_test_id("program-verdict")).to_contain_text("Enters at line 5 with G1 G17 G21 G90 G54")
    page.get_by_test_id("load-program").click()
    expect(page.get_by_test_id("load-program")).to_be_disabled(timeout=LIMIT_MS)
    page.get_by_test_id("start").click()
    expect(page.get_by_text("line 5: G1 G17 G21 G90 G54 G64 P0.02 F300")).to_be_visible(timeout=LIMIT_MS)
    page.get_by_test_id("confirm").click()
    expect(stage).to_contain_text("Running", timeout=LIMIT_MS)
    expect(stage).to_contain_text("Ready", timeout=LIMIT_MS)

    page.get_by_test_id("mdi-line").fill("G0 X-2 Y0")
    page.get_by_test_id("mdi-line").press("Enter")
    expect(page.get_by_test_id("mdi-again-0")).to_have_text("G0 X-2 Y0", timeout=LIMIT_MS)
    expect(stage).to_contain_text("Ready", timeout=LIMIT_MS)


def load_the_circle(page: Page, url: str) -> None:
    go(page, f"{url}/motion")
    page.get_by_test_id("program-choice").click()
    page.get_by_role("option", name="circle.toml").click()
    expect(page.get_by_test_id("program-verdict")).to_contain_text("within the limits")
    page.get_by_test_id("load-program").click()
    expect(page.get_by_test_id("program-name")).to_have_text("circle.toml", timeout=LIMIT_MS)
