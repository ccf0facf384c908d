"""The Scope page as an operator uses it: watch, trigger, measure, save, at every width and colour scheme."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from choices import choose
from live_page import await_connection
from playwright.sync_api import expect

from servo_ctrl.recording.reader import load_recording

if TYPE_CHECKING:
    from collections.abc import Callable

    from page_server import Stub
    from playwright.sync_api import Page


CHART = "getElement(document.querySelector('[data-testid=scope-chart]').id.slice(1)).chart"
MOST_SECONDS = 10
"""Until a browser beside other work has drawn what was sent to it."""
ZOOM = f"{CHART}.getOption().dataZoom[0]"


def zoom(page: Page) -> tuple[float, float]:
    """Begin and end of what is shown, in per cent of the picture."""
    found = page.evaluate(f"[{ZOOM}.start, {ZOOM}.end]")
    return found[0], found[1]


def frames(page: Page) -> int:
    return int(page.get_by_test_id("scope-chart").get_attribute("data-frames") or "0")


def wait_for_more_frames(page: Page, more: int) -> None:
    wanted = frames(page) + more
    chart = "document.querySelector('[data-testid=scope-chart]')"
    page.wait_for_function(f"Number({chart}.dataset.frames || 0) >= {wanted}")


def test_channels_are_drawn_live_and_no_peak_is_lost(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None]
) -> None:
    page = visit("/scope")
    choose(page.get_by_test_id("scope-span-s"), "30 s")
    wait_for_more_frames(page, 10)
    # the bump of a reversal lasts a few rows of 30000; its height is in what the browser draws
    page.wait_for_function(
        """() => {
          const chart = document.querySelector('[data-testid=scope-chart]');
          const arrays = getElement(chart.id.slice(1)).arrays;
          return arrays.length === 5 && Math.max(...arrays[1]) > 4.8e-6 && Math.min(...arrays[1]) < -4.8e-6;
        }""",
        timeout=20_000,
    )
    picture(page, "scope_running")


def test_a_single_picture_of_a_reversal_is_measured_and_saved(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None]
) -> None:
    page = visit("/scope")
    choose(page.get_by_test_id("scope-span-s"), "200 ms")
    choose(page.get_by_test_id("scope-kind"), "reversal of an axis")
    page.get_by_role("button", name="Single").click()
    expect(page.get_by_test_id("scope-state")).to_have_text("captured")
    page.get_by_label("Cursor A").fill("0")
    page.get_by_label("Cursor B").fill("100")
    readings = page.get_by_test_id("scope-readings")
    row = readings.get_by_role("row", name="X commanded velocity")
    # half a turn of the stub's circle is 2 s: R w sin(w 0.1 s) with R = 25 mm
    expect(row.get_by_role("cell").nth(2)).to_have_text(re.compile("^[+\N{MINUS SIGN}]6[.]1[0-9]$"))
    expect(readings.get_by_role("row", name="1 /")).to_contain_text("10")
    page.get_by_test_id("scope-save").click()
    saved = page.get_by_test_id("scope-saved")
    expect(saved).to_be_visible()
    picture(page, "scope_reversal")
    recording = load_recording(Path(saved.inner_text().removeprefix("Saved in ")))
    assert len(recording.columns["cycle"]) == 200
    with page.expect_download() as download:
        page.get_by_test_id("scope-download-csv").click()
    assert len(download.value.path().read_text().splitlines()) == 201


def test_a_set_with_a_computed_channel_is_kept_for_others_and_events_are_marked(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None]
) -> None:
    page = visit("/scope")
    page.get_by_test_id("scope-math").click()
    page.get_by_test_id("scope-expression").fill("abs(x.position_error_m) * 2e6 [nm]")
    page.get_by_test_id("scope-expression-add").click()
    measured = page.get_by_test_id("scope-measured")
    expect(measured.get_by_role("row", name="abs(x.position_error_m)")).to_contain_text("10.000")
    page.get_by_test_id("scope-set-name").fill("errors")
    page.get_by_test_id("scope-set-keep").click()
    expect(page.get_by_text("Set errors is kept.")).to_be_visible()
    now = stub.status()
    events = [{"cycle": now + 100 * number, "text": "made up", "time": ""} for number in range(2000)]
    stub.status(events=events)
    expect(page.get_by_test_id("scope-events")).to_contain_text("made up")
    picture(page, "scope_computed")
    page.reload()
    await_connection(page)
    expect(page.get_by_test_id("scope-expressions")).to_be_empty()
    choose(page.get_by_test_id("scope-set"), "errors")
    expect(measured.get_by_role("row", name="abs(x.position_error_m)")).to_be_visible()
    page.get_by_test_id("scope-set-delete").click()
    expect(page.get_by_text("is deleted")).to_be_visible()


def test_hold_keeps_the_picture(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit("/scope")
    wait_for_more_frames(page, 3)
    page.get_by_test_id("scope-hold").click()
    expect(page.get_by_test_id("scope-state")).to_have_text("held")
    drawn = [-1, frames(page)]
    while drawn[-1] != drawn[-2] and len(drawn) < MOST_SECONDS:  # what was under way when it was held
        since = stub.status()
        stub.wait(lambda: stub.status() > since + 1000)  # noqa: B023  # it has ended before the next one
        drawn.append(frames(page))
    assert drawn[-1] == drawn[-2]  # a second without a frame; four at least are drawn where none is held
    page.get_by_test_id("scope-hold").click()
    wait_for_more_frames(page, 2)


def test_a_stop_of_the_machine_triggers_the_scope(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None]
) -> None:
    page = visit("/scope", width=360, dark=True)
    choose(page.get_by_test_id("scope-kind"), "fault or stop")
    choose(page.get_by_test_id("scope-span-s"), "100 ms")
    page.get_by_role("button", name="Normal").click()
    expect(page.get_by_test_id("scope-state")).to_have_text("waiting for the trigger")
    stub.status(stage="quick_stopping", reason="following error of x")
    expect(page.get_by_test_id("scope-state")).to_contain_text("triggered")
    wait_for_more_frames(page, 0)
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    picture(page, "scope_narrow_dark")


def test_charts_and_readings_follow_the_units(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit("/scope")
    wait_for_more_frames(page, 2)
    choose(page.get_by_label("Units"), "inch")
    expect(page.get_by_test_id("scope-readings")).to_contain_text("in/s")
    expect(page.get_by_test_id("scope-readings")).to_contain_text("\N{MICRO SIGN}in")


def test_the_scope_goes_on_after_a_lost_connection(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit("/scope")
    wait_for_more_frames(page, 3)
    page.evaluate("window.socket.io.engine.close()")
    wait_for_more_frames(page, 5)


def test_the_wheel_zooms_along_time_and_pans_with_ctrl(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit("/scope")
    wait_for_more_frames(page, 5)
    page.get_by_role("button", name="Hold").click()
    chart = page.get_by_test_id("scope-chart")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    assert box is not None
    middle_x, middle_y = box["x"] + 0.5 * box["width"], box["y"] + 0.3 * box["height"]
    page.mouse.move(middle_x, middle_y)
    page.mouse.wheel(0, -300)
    page.wait_for_function(f"{ZOOM}.end - {ZOOM}.start < 95")
    start, end = zoom(page)
    page.keyboard.down("Control")
    page.mouse.down()
    page.mouse.move(middle_x - 0.02 * box["width"], middle_y, steps=5)
    page.mouse.up()
    page.keyboard.up("Control")
    page.wait_for_function(f"Math.abs({ZOOM}.start - {start}) > 0.1")
    moved_start, moved_end = zoom(page)
    assert moved_end - moved_start == pytest.approx(end - start, rel=1e-6)  # a pan changes no scale
    page.get_by_test_id("scope-whole").click()
    page.wait_for_function(f"{ZOOM}.start === 0 && {ZOOM}.end === 100")
