from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from eventually import eventually
from playwright.sync_api import expect
from stub_status import first_status

from servo_ctrl.commands.local_codec import to_plain

if TYPE_CHECKING:
    from collections.abc import Callable

    from page_server import Server, Stub
    from playwright.sync_api import BrowserContext, Page, Route

FIRST = to_plain(first_status())
PLOT_LIBRARY = "**/esm/*/index.js"


def take_control(page: Page) -> None:
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("control-holder")).to_have_text("You have control")


def pick(page: Page, address: str) -> None:
    """Find an object by its index and pick it."""
    page.get_by_test_id("object-filter").fill(address)
    tree = page.get_by_test_id("object-tree")
    expect(tree.get_by_text(address)).to_have_count(1)
    branch = tree.locator(".q-tree__node--parent > .q-tree__node-header")
    expect(branch).to_have_count(1)  # the others are filtered out
    if not tree.get_by_text(address).is_visible():
        branch.click()
    tree.get_by_text(address).click()
    expect(page.get_by_test_id("object-title")).to_contain_text(address)


def test_load_cycle_times_nodes_and_emergencies_are_shown(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit("/bus")
    expect(page.get_by_test_id("load")).to_have_text("62.0 %")
    expect(page.get_by_test_id("cycle-summary")).to_contain_text(
        "1000 cycles; 51 % took 1000\N{EN DASH}1100 µs"
    )
    expect(page.get_by_test_id("emcy-table")).to_contain_text("8611h")
    expect(page.get_by_test_id("emcy-table")).to_contain_text("generic, device profile")
    bus = {**FIRST["bus"], "load": 0.93, "missed_ticks": 7}
    lost = {**FIRST["nodes"][1], "nmt_state": "stopped", "heartbeat_age_s": 3.25}
    stub.status(bus=bus, nodes=[FIRST["nodes"][0], lost, *FIRST["nodes"][2:]], emcy=[])
    expect(page.get_by_test_id("load")).to_have_text("⚠ 93.0 %")
    expect(page.get_by_test_id("missed-ticks")).to_have_text("⚠ 7")
    row = page.get_by_test_id("node-table").get_by_role("row", name="axis.x.scale")
    expect(row).to_contain_text("⚠ stopped")
    expect(row).to_contain_text("3.25 s ago")
    expect(page.get_by_test_id("emcy-none")).to_be_visible()
    take_control(page)
    page.get_by_test_id("clear-counters").click()
    eventually(lambda: [request["do"] for request in stub.requests()], ["clear_counters"])


def test_an_object_is_read_on_request_and_written_only_when_it_fits_and_is_confirmed(
    visit: Callable[..., Page], picture: Callable[[Page, str], None], stub: Stub
) -> None:
    page = visit("/bus")
    take_control(page)
    pick(page, "605A:00")
    expect(page.get_by_test_id("object-facts")).to_contain_text("INTEGER16, rw")
    expect(page.get_by_test_id("object-facts")).to_contain_text("0 … 8")
    assert stub.requests() == []
    page.get_by_test_id("object-read").click()
    expect(page.get_by_test_id("object-value")).to_have_text("0 (0000h)")
    field, write = page.get_by_test_id("object-input"), page.get_by_test_id("object-write")
    for text, reason in (("9", "9 is outside 0 ... 8"), ("x", "whole number"), ("", "whole number")):
        field.fill(text)
        write.click()
        expect(page.get_by_test_id("object-problem")).to_contain_text(reason)
    field.fill("0x6")
    write.click()
    expect(page.get_by_text("becomes 6 (0006h)")).to_be_visible()
    page.get_by_test_id("leave-it").click()
    expect(page.get_by_text("becomes 6 (0006h)")).to_be_hidden()
    write.click()
    picture(page, "bus-write")
    page.get_by_test_id("confirm").click()
    expect(page.get_by_test_id("object-value")).to_have_text("6 (0006h)")
    asked = [(request["do"], request.get("value")) for request in stub.requests()]
    assert asked == [("read_object", None), ("write_object", 6), ("read_object", None)]
    written = stub.requests()[1]
    assert (written["node"], written["index"], written["subindex"]) == (1, 0x605A, 0)


def test_a_refusal_shows_its_reason_and_a_constant_object_has_no_field(
    visit: Callable[..., Page], stub: Stub
) -> None:
    no: dict[str, Any] = {"accepted": False, "refusal": "wrong_state", "reason": "the machine is running"}
    stub.link(answers={"write_object": no, "read_object": {**no, "reason": "node 11 did not answer"}})
    page = visit("/bus")
    take_control(page)
    page.get_by_test_id("object-node").click()
    page.get_by_role("option", name="axis.x.scale").click()
    expect(page.get_by_test_id("object-tree").get_by_text("6004:00")).to_have_count(1)
    pick(page, "1008:00")
    expect(page.get_by_test_id("object-input")).to_be_hidden()
    page.get_by_test_id("object-read").click()
    expect(page.get_by_test_id("object-problem")).to_have_text("Not read: node 11 did not answer")
    pick(page, "1017:00")
    page.get_by_test_id("object-input").fill("100")
    page.get_by_test_id("object-write").click()
    page.get_by_test_id("confirm").click()
    expect(page.get_by_test_id("object-problem")).to_have_text("Not written: the machine is running")
    assert {request["node"] for request in stub.requests()} == {11}


@pytest.mark.parametrize("eds", ["eds/nowhere.eds", "README.md"])
def test_an_unreadable_eds_is_reported(visit: Callable[..., Page], stub: Stub, eds: str) -> None:
    stub.link(hello={"nodes": [{"name": "axis.x.drive", "node_id": 1, "eds": eds}]})
    page = visit("/bus")
    expect(page.get_by_test_id("object-problem")).to_contain_text(eds)


def test_nothing_is_wider_than_a_telephone(
    visit: Callable[..., Page], picture: Callable[[Page, str], None], stub: Stub
) -> None:
    page = visit("/bus", width=360, dark=True)
    pick(page, "6064:00")
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    picture(page, "bus-narrow")


def test_a_plot_removed_before_plotly_was_loaded_is_no_error(
    visiting: Callable[..., BrowserContext], stub_server: Server, stub: Stub
) -> None:
    """Another machine is greeted meanwhile: the page is made anew, and the plots that were to be go."""
    context = visiting(stub_server.url)
    held: list[Route] = []

    def hold(route: Route) -> None:
        held.append(route)

    context.route(PLOT_LIBRARY, hold)
    page = context.new_page()
    with page.expect_request(PLOT_LIBRARY):
        page.goto(f"{stub_server.url}/bus")
    plot = page.get_by_test_id("cycle-plot")
    expect(plot).to_be_attached()
    first = plot.get_attribute("id")
    stub.link(hello={"machine": "another one"})
    expect(page.locator(f"#{first}")).not_to_be_attached()
    expect(plot).to_be_attached()
    for route in held:
        route.continue_()
    expect(plot.locator(".main-svg").first).to_be_visible()
    page.evaluate("() => new Promise((seen) => requestAnimationFrame(() => requestAnimationFrame(seen)))")
