from __future__ import annotations

import re
from importlib.resources import files
from typing import TYPE_CHECKING

import pytest
from choices import choose
from live_page import await_connection, go
from playwright.sync_api import expect

if TYPE_CHECKING:
    from collections.abc import Callable

    from page_server import Server, Stub
    from playwright.sync_api import BrowserContext, Page

PAGES = ("/", "/motion", "/scope", "/contour", "/friction", "/reconcile", "/tuning", "/bus")


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
    stub.wait(lambda: len(stub.commands()) == 1)
    page.get_by_test_id("units").focus()
    page.keyboard.press("Escape")
    stub.wait(lambda: len(stub.commands()) == 2)
    stop.focus()
    page.keyboard.press("Enter")
    stub.wait(lambda: len(stub.commands()) == 3)
    assert set(stub.commands()) == {"quick_stop"}
    expect(page.locator("#bench-stop-failed")).to_be_hidden()


def test_a_failed_stop_shows_a_banner(visit: Callable[..., Page], stub: Stub) -> None:
    stub.link(answers={"quick_stop": {"accepted": False, "reason": "there is no connection"}})
    page = visit()
    page.get_by_test_id("stop").click()
    expect(page.locator("#bench-stop-failed")).to_contain_text("there is no connection")
    expect(page.locator("#bench-stop-failed")).to_contain_text("Use the emergency stop")


def test_content_is_grey_while_the_controller_does_not_answer(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None]
) -> None:
    page = visit()
    expect(page.get_by_test_id("unlinked")).to_be_hidden()
    stub.link(connected=False)
    expect(page.get_by_test_id("unlinked")).to_be_visible()
    assert "grayscale" in page.get_by_test_id("content").evaluate("e => getComputedStyle(e).filter")
    picture(page, "controller_away")
    stub.link(connected=True)
    expect(page.get_by_test_id("unlinked")).to_be_hidden()


def test_a_banner_shows_when_the_page_is_disconnected(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit()
    expect(page.locator("#bench-stale-banner")).to_be_hidden()
    page.evaluate("window.socket.disconnect()")
    expect(page.locator("#bench-stale-banner")).to_be_visible()
    for old in (".bench-who", ".bench-foot", ".bench-content"):  # the state of the machine in the head, too
        assert "grayscale" in page.locator(old).evaluate("e => getComputedStyle(e).filter"), old
    expect(page.get_by_test_id("content")).to_have_css("pointer-events", "none")  # a click would be lost
    expect(page.get_by_test_id("stop")).to_have_css("pointer-events", "auto")


def test_a_click_whose_connection_breaks_is_named_and_sent_again_by_hand(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None]
) -> None:
    page = visit()
    lost = page.locator("#bench-lost-click")
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("control-holder")).to_have_text("You have control")
    expect(lost).to_be_hidden()
    # the bytes of the click vanish, then the connection ends; the page connects again by itself
    page.evaluate("window.socket.io.engine.transport.ws.send = () => {}")
    page.get_by_test_id("home").click()
    page.evaluate("window.socket.io.engine.close()")
    expect(lost).to_contain_text('The connection broke as "Home" was pressed')
    picture(page, "click_lost")
    page.wait_for_function("window.socket.connected")
    assert stub.commands() == []
    page.get_by_test_id("home").click()
    expect(lost).to_be_hidden()
    page.evaluate("window.socket.disconnect()")
    page.get_by_test_id("disable").click()
    expect(lost).to_contain_text('"Disable" was not carried out. Press it again')
    page.evaluate("window.socket.connect()")
    page.wait_for_function("window.socket.connected")
    expect(page.locator("#bench-stale-banner")).to_be_hidden()
    assert stub.commands() == ["home"]  # a click without a connection is not kept for later


CONTROLS = (
    "button, a[href], input, textarea, select, [role=switch], [role=checkbox], [role=tab], [role=combobox]"
)
BEYOND_THE_KEYS = f"""() => [...document.querySelectorAll("{CONTROLS}")]
  .filter(one => one.checkVisibility() && !one.disabled && one.getAttribute("aria-disabled") !== "true")
  .filter(one => !one.closest("[role=tablist]")?.querySelector("[tabindex='0']"))  // arrow keys pick a tab
  .filter(one => one.tabIndex < 0 && !one.closest("[tabindex='0']") && !one.querySelector("[tabindex='0']"))
  .map(one => one.outerHTML.slice(0, 160))"""


@pytest.mark.parametrize(
    "path", ["/", "/motion", "/scope", "/contour", "/friction", "/reconcile", "/tuning", "/bus"]
)
def test_every_control_is_reached_by_the_keyboard(visit: Callable[..., Page], stub: Stub, path: str) -> None:
    page = visit(path)
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("control-holder")).to_have_text("You have control")
    assert page.locator(CONTROLS).count() > 10
    assert page.evaluate(BEYOND_THE_KEYS) == []


def test_the_head_leaves_room_on_a_telephone(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None]
) -> None:
    page = visit("/bus", width=390)
    # what the head shows comes one after the other, and it wraps until the last has its place
    page.wait_for_function("document.querySelector('header').getBoundingClientRect().height <= 120")
    expect(page.get_by_test_id("link-bus")).to_be_in_viewport(ratio=1.0)
    page.get_by_test_id("link-drive").click()
    page.wait_for_url("**/")  # the Bus page has the same head
    await_connection(page)
    expect(page.get_by_test_id("power")).to_be_visible()
    page.get_by_role("combobox", name="Units").focus()
    expect(page.get_by_test_id("units")).to_be_in_viewport(ratio=0.9)
    picture(page, "drive_390")


def test_taking_over_control_is_confirmed_and_the_other_browser_is_notified(
    visit: Callable[..., Page], stub: Stub
) -> None:
    first, second = visit(), visit(another=True)
    first.get_by_test_id("take-control").click()
    expect(second.get_by_test_id("control-holder")).to_have_text("local (127.0.0.1) has control")
    second.get_by_test_id("take-control").click()
    second.get_by_test_id("confirm").click()
    expect(second.get_by_test_id("control-holder")).to_have_text("You have control")
    expect(first.get_by_text("has taken over control")).to_be_visible()
    home = first.get_by_test_id("home")
    expect(home).to_be_disabled()
    expect(home).to_have_accessible_description(re.compile("^local has control. Take it first"))
    assert stub.commands() == []
    second.reload()
    expect(second.get_by_test_id("control-holder")).to_have_text("You have control")


def test_the_language_is_that_of_the_browser_until_another_is_picked(
    visiting: Callable[..., BrowserContext], stub: Stub, stub_server: Server
) -> None:
    page = visiting(stub_server.url, locale="de-DE").new_page()
    go(page, stub_server.url)
    expect(page.get_by_test_id("stage")).to_contain_text("Bereit")
    expect(page.locator("html")).to_have_attribute("lang", "de-DE")
    choose(page.get_by_test_id("language"), "EN")
    expect(page.get_by_test_id("stage")).to_contain_text("Ready")
    page.reload()
    expect(page.get_by_test_id("stage")).to_contain_text("Ready")


AS_CONNECTED = """
* { transition: none !important; animation: none !important }
.bench-who, .bench-foot, .bench-content { filter: none !important; opacity: 1 !important }
"""
"""A button that is just becoming enabled has colours between two states. A page that hears nothing for some
seconds is dimmed on purpose, and it hears nothing while axe-core keeps a busy computer's browser."""


@pytest.mark.parametrize("dark", [True, False])
def test_pages_keep_wcag_aa_by_axe(visit: Callable[..., Page], stub: Stub, dark: bool) -> None:
    axe = files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8")
    problems = []
    for path in PAGES if dark else ("/", "/motion"):
        page = visit(path, dark=dark)
        expect(page.get_by_test_id("machine")).to_have_text("stub table")
        page.add_style_tag(content=AS_CONNECTED)
        page.evaluate(axe)
        result = page.evaluate("axe.run({runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa']})")
        problems += [
            (path, one["id"], node["html"][:120]) for one in result["violations"] for node in one["nodes"]
        ]
        page.close()
    assert problems == []
