from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

if TYPE_CHECKING:
    from collections.abc import Callable

    from page_server import Stub
    from playwright.sync_api import Page


def jogs(stub: Stub) -> list[tuple[str, float]]:
    return [(request["axis"], request["value"]) for request in stub.requests() if request["do"] == "jog"]


def test_enable_disable_and_home_send_their_commands(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit()
    page.get_by_test_id("take-control").click()
    page.get_by_test_id("home").click()
    page.get_by_test_id("disable").click()
    expect(page.get_by_test_id("stage")).to_contain_text("Standby")
    expect(page.get_by_test_id("home")).to_be_disabled()
    page.get_by_test_id("enable").click()
    expect(page.get_by_test_id("stage")).to_contain_text("Ready")
    assert stub.commands() == ["home", "disable", "enable"]


def test_a_jog_is_renewed_while_the_button_is_held_and_ends_with_zero(
    visit: Callable[..., Page], stub: Stub
) -> None:
    page = visit()
    page.get_by_test_id("take-control").click()
    button = page.get_by_test_id("jog-x-plus")
    expect(button).to_have_attribute("aria-disabled", "false")
    button.hover()
    page.mouse.down()
    stub.wait(lambda: len(jogs(stub)) >= 4)
    page.mouse.up()
    stub.wait(lambda: jogs(stub)[-1] == ("x", 0.0))
    asked = jogs(stub)
    assert asked == [("x", 0.001)] * (len(asked) - 1) + [("x", 0.0)]


@pytest.mark.parametrize("end", ["keyup", "blur", "closed"])
def test_a_jog_by_key_ends_with_the_key_the_focus_and_the_page(
    visit: Callable[..., Page], stub: Stub, end: str
) -> None:
    page = visit()
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("jog-y-minus")).to_have_attribute("aria-disabled", "false")
    page.keyboard.down("ArrowDown")
    stub.wait(lambda: bool(jogs(stub)))
    match end:
        case "keyup":
            page.keyboard.up("ArrowDown")
        case "blur":
            page.evaluate("window.dispatchEvent(new Event('blur'))")
        case "closed":
            page.close()
    stub.wait(lambda: jogs(stub)[-1:] == [("y", 0.0)])
    assert jogs(stub)[0] == ("y", -0.001)
    assert [value for _, value in jogs(stub)].count(0.0) == 1


def test_without_control_nothing_moves(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit()
    page.get_by_test_id("jog-x-plus").hover()
    page.mouse.down()
    page.wait_for_timeout(250)
    page.mouse.up()
    page.keyboard.press("ArrowLeft")
    for name in ("home", "disable", "jog-x-plus", "step-x-plus", "touch-off-x", "clear-offset"):
        button = page.get_by_test_id(name)
        expect(button).to_be_disabled()
        expect(button).to_have_accessible_description(re.compile("^Nobody has control. Take it first"))
    assert stub.requests() == []
    page.get_by_test_id("take-control").click()
    for name in ("home", "disable", "jog-x-plus", "step-x-plus", "touch-off-x", "clear-offset"):
        expect(page.get_by_test_id(name)).to_be_enabled()
        expect(page.get_by_test_id(name)).to_have_accessible_description("")
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("home")).to_be_disabled()
    page.get_by_test_id("stop").click()
    expect(page.get_by_test_id("stage")).to_contain_text("Standby")
    assert stub.commands() == ["quick_stop"]


def test_a_fault_is_shown_with_its_reason_and_advice(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None]
) -> None:
    reason = "axis x: following error of 1.234 mm exceeds 1 mm"
    stub.status(stage="standby", reason=reason)
    page = visit()
    fault = page.get_by_test_id("fault")
    expect(fault).to_contain_text("The axis did not follow")
    expect(fault).to_contain_text("Free it, then Enable")
    expect(fault).to_contain_text(reason)
    expect(page.get_by_test_id("stage")).to_contain_text("Fault")
    picture(page, "drive_fault")


def test_positions_follow_the_units(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit()
    card = page.get_by_test_id("axis-x")
    expect(card).to_contain_text("100")
    page.get_by_test_id("units").click()
    page.get_by_role("option", name="inch").click()
    expect(card).to_contain_text("3.93701")
    page.reload()
    expect(page.get_by_test_id("axis-x")).to_contain_text("3.93701")


RENDERINGS_WHILE_IT_MOVES = """async () => {
  let renderings = 0;
  const position = document.querySelector("[data-testid=position-x]");
  window.socket.on("update", () => renderings++);
  for (let changes = 0; changes < 5; changes++) {
    const shown = position.textContent;
    while (position.textContent === shown) await new Promise((resolve) => setTimeout(resolve, 20));
  }
  return renderings;
}"""


def test_positions_follow_the_machine_without_rendering_the_page_anew(visit: Callable[..., Page]) -> None:
    page = visit()
    cycles = page.get_by_test_id("cycle-count")
    expect(cycles).to_contain_text("cycle")
    assert page.evaluate(RENDERINGS_WHILE_IT_MOVES) == 0
    page.reload()  # somebody who comes later sees them too
    expect(cycles).to_contain_text("cycle")
    expect(page.get_by_test_id("position-x")).to_have_text(re.compile(r"\d"))


@pytest.mark.parametrize(("width", "dark"), [(1280, False), (1280, True), (360, False), (360, True)])
def test_it_fits_its_width(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None], width: int, dark: bool
) -> None:
    page = visit(width=width, dark=dark)
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("control-holder")).to_have_text("You have control")
    picture(page, f"drive_{width}_{'dark' if dark else 'light'}")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
