"""What an operator does, from switching on to the stop, on a simulated table over the real bus."""

import contextlib
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from choices import choose
from live_page import go
from playwright.sync_api import BrowserContext, Page, expect
from simulated_table import (
    SHORT_CIRCLE,
    SHORT_LEARNING,
    ServedTable,
    opened,
    served_table,
    table_directory,
)

from servo_ctrl.recording.reader import load_recording

LIMIT_MS = 240_000
CAPTURED_ROWS = 100
"""200 ms in cycles of 2 ms."""
REQUIRED_UM = 4.0
"""Of the machine file as it is shipped."""
PART = """G21 G90 G64 P0.02
G0 X0 Y0
G1 X4 F300
Y3
X0
G0 Y0
M2
"""


@pytest.fixture
def table(tmp_path: Path, environment: dict[str, str], free_port: Callable[[], int]) -> Iterator[ServedTable]:
    """A simulated table under the real controller, its drives off."""
    programs = {"circle.toml": SHORT_CIRCLE, "part.ngc": PART.replace("X4", "X400")}
    machine = table_directory(tmp_path / "table", SHORT_LEARNING, programs)
    with served_table(machine, tmp_path, free_port(), environment, page_apart=True) as served:
        yield served


def error_of(page: Page, axis: str) -> float:
    """J of the last reversals as the Friction page shows it, micrometres."""
    label = page.get_by_test_id(f"j-{axis}")
    expect(label).to_contain_text(re.compile(r"\d"), timeout=LIMIT_MS)
    found = re.search(r"[\d.]+", label.inner_text())
    assert found is not None
    return float(found[0])


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


def armed_scope(page: Page, url: str) -> Page:
    """The scope in another tab of the same browser, which waits for a reversal of x."""
    scope = page.context.new_page()
    go(scope, f"{url}/scope")
    choose(scope.get_by_test_id("scope-span-s"), "200 ms")
    choose(scope.get_by_test_id("scope-kind"), "reversal of an axis")
    scope.get_by_role("button", name="Single").click()
    expect(scope.get_by_test_id("scope-state")).to_have_text("waiting for the trigger", timeout=LIMIT_MS)
    return scope


def save_the_capture(scope: Page, picture: Callable[[Page, str], None]) -> None:
    """The reversal stands a quarter behind the beginning, in every channel of the saved recording."""
    expect(scope.get_by_test_id("scope-state")).to_have_text("taken", timeout=LIMIT_MS)
    scope.get_by_test_id("scope-save").click()
    saved = scope.get_by_test_id("scope-saved")
    expect(saved).to_contain_text("Saved in ", timeout=LIMIT_MS)
    picture(scope, "operator_5_captured")
    captured = load_recording(Path(saved.inner_text().removeprefix("Saved in "))).columns
    command_m = captured["x.position_command_m"]
    steps_m = np.diff(command_m)
    at = len(command_m) // 4
    before_m, after_m = steps_m[: at - 1], steps_m[at - 1 :]
    assert len(command_m) == CAPTURED_ROWS
    assert before_m.sum() * after_m.sum() < 0.0
    assert np.abs(captured["x.scale_position_m"] - command_m).max() > 0.0
    scope.close()


def learn_and_see_j_fall(page: Page, table_url: str, picture: Callable[[Page, str], None]) -> None:
    stage = page.get_by_test_id("stage")
    go(page, f"{table_url}/friction")
    before_um = error_of(page, "x")
    picture(page, "operator_3_error")
    page.get_by_test_id("start-learning").click()
    # in a starved browser the short run may be over before it has been seen
    expect(page.get_by_test_id("learning-state")).to_contain_text("Axis x", timeout=LIMIT_MS)
    expect(page.get_by_test_id("learning-best")).to_contain_text(re.compile(r"\d"), timeout=LIMIT_MS)
    picture(page, "operator_4_learning")
    expect(page.get_by_test_id("version-x")).to_contain_text("version 1", timeout=LIMIT_MS)
    expect(stage).to_contain_text("Ready", timeout=LIMIT_MS)

    scope = armed_scope(page, table_url)
    run_circle(page, table_url)
    save_the_capture(scope, picture)
    go(page, f"{table_url}/friction")
    required = page.get_by_test_id("required-x")
    expect(required).to_have_text(re.compile("median of the last .*4[.]00"), timeout=LIMIT_MS)
    expect(required).not_to_contain_text("above it")
    after_um = error_of(page, "x")
    picture(page, "operator_5_learned")
    assert after_um <= REQUIRED_UM < before_um


def kill_the_simulator_in_motion_and_go_on(page: Page, table: ServedTable) -> None:
    stage = page.get_by_test_id("stage")
    start_the_program(page)
    table.restart_simulator()
    go(page, table.url)
    expect(stage).to_contain_text("Fault", timeout=LIMIT_MS)
    page.get_by_test_id("enable").click()
    expect(stage).to_contain_text("Ready", timeout=LIMIT_MS)
    expect(page.get_by_test_id("events")).to_contain_text("it homes again")


@pytest.mark.timeout(900)
def test_a_day_of_an_operator(
    table: ServedTable, visiting: Callable[..., BrowserContext], picture: Callable[[Page, str], None]
) -> None:
    served, table_url = table, table.url
    page = opened(visiting(table_url), table_url)
    stage = page.get_by_test_id("stage")
    expect(stage).to_contain_text("Standby", timeout=LIMIT_MS)
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("control-holder")).to_have_text("You have control")
    page.get_by_test_id("enable").click()
    expect(stage).to_contain_text("Ready", timeout=LIMIT_MS)
    expect(page.get_by_test_id("drive-state-x")).to_contain_text("under control")
    expect(page.get_by_test_id("drive-standard-x")).to_have_text("operation enabled")
    step_and_touch_off(page)
    picture(page, "operator_1_enabled")

    go(page, f"{table_url}/motion")
    mend_and_load_the_part(page)
    run_the_part(page, picture)
    expect_x_at_zero(page, table_url)

    go(page, f"{table_url}/motion")
    page.get_by_test_id("program-choice").click()
    page.get_by_role("option", name="circle.toml").click()
    expect(page.get_by_test_id("program-verdict")).to_contain_text("within the limits")
    page.get_by_test_id("load-program").click()
    expect(page.get_by_test_id("program-name")).to_have_text("circle.toml", timeout=LIMIT_MS)
    run_circle(page, table_url)
    picture(page, "operator_2_circle")

    learn_and_see_j_fall(page, table_url, picture)

    go(page, f"{table_url}/motion")
    kill_the_simulator_in_motion_and_go_on(page, served)

    go(page, f"{table_url}/motion")
    start_the_program(page)
    page.get_by_test_id("stop").click()
    expect(stage).to_contain_text("Standby", timeout=LIMIT_MS)
    go(page, table_url)
    expect(page.get_by_test_id("stage-reason")).to_have_text(re.compile("quick stop by"))
    expect(page.get_by_test_id("fault")).to_have_count(0)
    picture(page, "operator_6_stopped")
