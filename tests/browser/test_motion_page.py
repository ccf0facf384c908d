from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from choices import choose
from playwright.sync_api import TimeoutError as PlaywrightTimeout
from playwright.sync_api import expect

if TYPE_CHECKING:
    from collections.abc import Callable

    from page_server import Stub
    from playwright.sync_api import Page

MACHINE = Path(__file__).parents[2] / "machines" / "xy_table"
HOVERS, HOVER_MS = 12, 5000.0


def test_the_machines_program_is_checked_and_its_path_drawn(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None]
) -> None:
    page = visit("/motion")
    expect(page.get_by_test_id("program-verdict")).to_contain_text("circles.toml: within the limits")
    expect(page.get_by_test_id("step-2")).to_contain_text("circle, 25 mm, 500 mm/min")
    expect(page.get_by_test_id("preview-figures")).to_contain_text("44.4 s")
    assert page.get_by_test_id("path").locator("svg path").count() > 5
    picture(page, "motion_1280_light")


def test_a_value_beyond_the_limits_shows_the_loaders_error_and_cannot_be_loaded(
    visit: Callable[..., Page], stub: Stub
) -> None:
    page = visit("/motion")
    page.get_by_test_id("take-control").click()
    verdict = page.get_by_test_id("program-verdict")
    expect(verdict).to_contain_text("within the limits")
    page.get_by_test_id("step-2").click()
    radius = page.get_by_test_id("step-2-radius_mm")
    radius.fill("500")
    radius.press("Tab")
    expect(verdict).to_contain_text('circles.toml: step[2] "F 500": axis y: position')
    expect(verdict).to_contain_text("is beyond the limit 100 mm")
    expect(page.get_by_test_id("load-program")).to_be_disabled()
    radius.fill("twenty")
    radius.press("Tab")
    expect(verdict).to_contain_text('step[2] "F 500".radius_mm')
    radius.fill("20")
    radius.press("Tab")
    expect(verdict).to_contain_text("within the limits")
    page.get_by_test_id("load-program").click()
    stub.wait(lambda: bool(stub.requests()))
    [request] = stub.requests()
    assert request["do"] == "load_program"
    assert request["program"]["name"] == "circles.toml"
    assert "radius_mm = 20.0" in request["program"]["text"]


def copied_machine(folder: Path, stub: Stub) -> Path:
    """The machine's files where a test may write; the page reads them there."""
    machine = folder / "xy_table"
    shutil.copytree(MACHINE, machine, ignore=shutil.ignore_patterns("learned"))
    shutil.copytree(MACHINE.parents[1] / "eds", folder.parent / "eds", dirs_exist_ok=True)
    stub.link(hello={"machine_file": str(machine / "controller.toml")})
    return machine


def expect_meaning(page: Page, mark: str, meaning: str) -> None:
    """Hover until the text is shown: where the page grows meanwhile, another field is under the pointer."""
    shown = page.get_by_role("tooltip").filter(has_text=meaning)
    for remaining in reversed(range(HOVERS)):
        page.mouse.move(1.0, 1.0)
        page.get_by_test_id(mark).hover()
        try:
            shown.first.wait_for(timeout=HOVER_MS)
            break
        except PlaywrightTimeout:
            if not remaining:
                raise
    page.mouse.move(1.0, 1.0)
    expect(page.get_by_role("tooltip")).to_have_count(0)


def test_a_field_under_the_pointer_says_what_it_means(
    visit: Callable[..., Page], stub: Stub, tmp_path: Path
) -> None:
    """Also in a form that was built while the text was shown."""
    machine = copied_machine(tmp_path, stub)
    (machine / "programs" / "part.ngc").write_text("G90 G1 X1 F500\nM2\n", encoding="utf-8")
    page = visit("/motion")
    expect(page.get_by_test_id("program-verdict")).to_contain_text("within the limits")
    page.get_by_test_id("step-2").click()
    expect(page.get_by_test_id("step-2-radius_mm")).to_be_visible()
    expect_meaning(page, "step-2-radius_mm", "Radius R")
    choose(page.get_by_test_id("program-choice"), "part.ngc")
    expect_meaning(page, "first-line", "Run from there")
    choose(page.get_by_test_id("program-choice"), "circles.toml")
    expect(page.get_by_test_id("program-verdict")).to_contain_text("within the limits")
    page.get_by_test_id("tab-form").click()
    page.get_by_test_id("step-2").click()
    expect_meaning(page, "step-2-radius_mm", "Radius R")


def test_a_grey_button_says_why_to_pointer_and_screen_reader(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit("/motion")
    start, hold = page.get_by_test_id("start"), page.get_by_test_id("hold")
    expect(start).to_be_disabled()
    expect(start).to_have_accessible_description(
        "Nobody has control. Take it first, in the head of the page."
    )
    page.get_by_test_id("take-control").click()
    expect(start).to_be_enabled()
    expect(start).to_have_accessible_description("")
    expect(hold).to_be_disabled()
    expect(hold).to_have_attribute("title", "no program is running")
    expect(hold).to_have_accessible_description("no program is running")


def test_start_hold_resume_and_abort_send_their_commands(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit("/motion")
    page.get_by_test_id("take-control").click()
    for name in ("start", "hold", "resume", "abort"):
        page.get_by_test_id(name).click()
    stub.wait(lambda: len(stub.commands()) == 4)
    assert stub.commands() == ["start_program", "hold_program", "resume_program", "abort_program"]


def test_the_text_is_edited_checked_and_saved_beside_the_others(
    visit: Callable[..., Page], stub: Stub, tmp_path: Path
) -> None:
    machine = copied_machine(tmp_path, stub)
    page = visit("/motion")
    expect(page.get_by_test_id("program-verdict")).to_contain_text("within the limits")
    page.get_by_test_id("tab-text").click()
    text = page.get_by_test_id("program-text")
    text.fill('[[step]]\nkind = "dwell"\nseconds = 1.0\nspeed = 2.0\n')
    text.press("Tab")
    expect(page.get_by_test_id("program-verdict")).to_contain_text("unknown key")
    text.fill('[[step]]\nkind = "dwell"\nseconds = 1.0\n')
    text.press("Tab")
    expect(page.get_by_test_id("program-verdict")).to_contain_text("within the limits")
    page.get_by_test_id("save-name").fill("../rest.toml")
    page.get_by_test_id("save-program").click()
    expect(page.get_by_text("is not a name for a program")).to_be_visible()
    page.get_by_test_id("save-name").fill("rest.toml")
    page.get_by_test_id("save-program").click()
    expect(page.get_by_text("rest.toml is saved")).to_be_visible()
    assert (machine / "programs" / "rest.toml").read_text() == '[[step]]\nkind = "dwell"\nseconds = 1.0\n'


def test_progress_and_a_refusal_are_shown(visit: Callable[..., Page], stub: Stub) -> None:
    program = {"name": "part.toml", "step": 2, "label": "F 500", "progress": 0.42, "held": False}
    stub.status(stage="running", program=program | {"loaded": True, "preparing": False, "problem": ""})
    page = visit("/motion")
    expect(page.get_by_test_id("program-step")).to_have_text('step 3 "F 500"')
    share, bar = page.get_by_test_id("progress-share"), page.get_by_test_id("progress")
    expect(share).to_have_text("42 %")
    page.evaluate("window.renderings = 0; window.socket.on('update', () => window.renderings++)")
    stub.status(program=program | {"loaded": True, "preparing": False, "problem": "", "progress": 0.5})
    expect(share).to_have_text("50 %")
    expect(bar).to_have_attribute("aria-valuenow", "0.5")
    assert page.evaluate("window.renderings") == 0
    problem = "part.toml: beyond the limit"
    stub.status(program=program | {"loaded": False, "preparing": False, "problem": problem})
    expect(page.get_by_test_id("program-problem")).to_have_text(problem)


@pytest.mark.parametrize("dark", [False, True])
def test_it_fits_a_narrow_screen(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None], dark: bool
) -> None:
    page = visit("/motion", width=360, dark=dark)
    expect(page.get_by_test_id("program-verdict")).to_contain_text("within the limits")
    page.get_by_test_id("step-2").click()
    expect(page.get_by_test_id("step-2-radius_mm")).to_be_visible()
    picture(page, f"motion_360_{'dark' if dark else 'light'}")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
