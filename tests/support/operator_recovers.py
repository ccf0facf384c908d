"""What an operator does beside production: a drive's object, a second operator, killed processes."""

import re
from collections.abc import Callable

from live_page import go
from operator_moves import LIMIT_MS, start_the_program
from playwright.sync_api import Page, expect
from playwright.sync_api import TimeoutError as TookTooLong
from simulated_table import ServedTable


def pick_quick_stop_option(page: Page, url: str) -> None:
    """Again where the page was cut off by a starved machine meanwhile and has loaded itself anew."""
    for last in (False, False, True):
        go(page, url)
        tree, title = page.get_by_test_id("object-tree"), page.get_by_test_id("object-title")
        try:
            tree.wait_for(timeout=LIMIT_MS)
            tree.get_by_text("Device profile").click()
            tree.get_by_text("605A:00").click()
            expect(title).to_contain_text("605A:00 Quick stop option code")
        except (TookTooLong, AssertionError):
            if last:
                raise
        else:
            return


def write_an_object(page: Page, url: str, picture: Callable[[Page, str], None]) -> None:
    """And read it back from the drive, on a page that knows nothing of the first."""
    value, before, after = page.get_by_test_id("object-value"), "2 (0002h)", "6 (0006h)"
    pick_quick_stop_option(page, f"{url}/bus")
    page.get_by_test_id("object-read").click()
    expect(value).to_have_text(before, timeout=LIMIT_MS)
    page.get_by_test_id("object-input").fill("6")
    page.get_by_test_id("object-write").click()
    page.get_by_test_id("confirm").click()
    expect(value).to_have_text(after, timeout=LIMIT_MS)
    expect(page.get_by_test_id("object-problem")).to_be_empty()
    picture(page, "operator_8_written")
    pick_quick_stop_option(page, f"{url}/bus")
    expect(value).to_be_empty()
    page.get_by_test_id("object-read").click()
    expect(value).to_have_text(after, timeout=LIMIT_MS)


def kill_the_simulator_in_motion_and_go_on(page: Page, table: ServedTable) -> None:
    stage = page.get_by_test_id("stage")
    start_the_program(page)
    table.restart_simulator()
    go(page, table.url)
    expect(stage).to_contain_text("Fault", timeout=LIMIT_MS)
    page.get_by_test_id("enable").click()
    expect(stage).to_contain_text("Ready", timeout=LIMIT_MS)
    expect(page.get_by_test_id("events")).to_contain_text("it homes again")


def take_over(page: Page, other: Page) -> None:
    """One operator takes control from the other, who is told so."""
    expect(other.get_by_test_id("control-holder")).to_have_text(
        "local (127.0.0.1) has control", timeout=LIMIT_MS
    )
    other.get_by_test_id("take-control").click()
    other.get_by_test_id("confirm").click()
    expect(page.get_by_text("has taken over control")).to_be_visible(timeout=LIMIT_MS)


def kill_the_controller_and_go_on(
    table: ServedTable, page: Page, other: Page, picture: Callable[[Page, str], None]
) -> None:
    table.kill_controller()
    for cut_off in (page, other):
        expect(cut_off.locator("body.bench-unlinked")).to_be_attached(timeout=LIMIT_MS)
    picture(page, "operator_9_controller_killed")
    table.start_controller()
    for back in (page, other):
        expect(back.locator("body.bench-unlinked")).not_to_be_attached(timeout=LIMIT_MS)
        expect(back.get_by_test_id("stage")).to_contain_text("Standby", timeout=LIMIT_MS)
    take_over(other, page)
    page.get_by_test_id("enable").click()
    expect(page.get_by_test_id("stage")).to_contain_text("Ready", timeout=LIMIT_MS)


def stop_in_motion(page: Page, url: str, picture: Callable[[Page, str], None]) -> None:
    stage = page.get_by_test_id("stage")
    start_the_program(page)
    page.get_by_test_id("stop").click()
    expect(stage).to_contain_text("Standby", timeout=LIMIT_MS)
    go(page, url)
    expect(page.get_by_test_id("stage-reason")).to_have_text(re.compile("quick stop by"))
    expect(page.get_by_test_id("fault")).to_have_count(0)
    picture(page, "operator_10_stopped")
