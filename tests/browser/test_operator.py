"""What an operator does, from switching on to the stop, on a simulated table over the real bus."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import BrowserContext, Page, expect
from simulated_table import opened, served_table, table_directory

LIMIT_MS = 240_000
SHORT = {
    "radius_mm = 50.0": "radius_mm = 2.0\ntrailing = false",
    "accelerations_mm_s2 = [2.0, 8.0, 30.0, 120.0]": "accelerations_mm_s2 = [140.0, 180.0, 220.0, 260.0]",
    "jerk_mm_s3 = 50000.0": "jerk_mm_s3 = 500000.0",
}
"""Strokes of a second: not what anybody would learn with, but the same code."""
CIRCLE = """
[[step]]
kind = "move"
label = "to the start"
to_mm = { x = 2.0, y = 0.0 }
feed_mm_min = 1000.0

[[step]]
kind = "circle"
label = "circle"
radius_mm = 2.0
feed_mm_min = 1200.0  # reverse acceleration 200 mm/s^2
turns = 15.0
ramp_s = 0.1

[[step]]
kind = "move"
label = "home"
to_mm = { x = 0.0, y = 0.0 }
feed_mm_min = 1000.0
"""


@pytest.fixture
def table(tmp_path: Path, environment: dict[str, str], free_port: Callable[[], int]) -> Iterator[str]:
    """A simulated table under the real controller, its drives off; yields the page's address."""
    machine = table_directory(tmp_path / "table", SHORT, {"circle.toml": CIRCLE})
    with served_table(machine, tmp_path, free_port(), environment) as url:
        yield url


def error_of(page: Page, axis: str) -> float:
    """J of the last reversal as the Friction page shows it, micrometres."""
    label = page.get_by_test_id(f"j-{axis}")
    expect(label).to_contain_text(re.compile(r"\d"), timeout=LIMIT_MS)
    found = re.search(r"[\d.]+", label.inner_text())
    assert found is not None
    return float(found[0])


def run_circle(page: Page, url: str) -> None:
    page.goto(f"{url}/motion")
    expect(page.get_by_test_id("start")).to_be_enabled(timeout=LIMIT_MS)
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("stage")).to_contain_text("Running", timeout=LIMIT_MS)
    expect(page.get_by_test_id("program-step")).to_contain_text("circle", timeout=LIMIT_MS)
    expect(page.get_by_test_id("stage")).to_contain_text("Ready", timeout=LIMIT_MS)


@pytest.mark.timeout(900)
def test_from_enable_over_a_circle_and_learning_to_the_stop(
    table: str, visiting: Callable[..., BrowserContext], picture: Callable[[Page, str], None]
) -> None:
    page = opened(visiting(table), table)
    stage = page.get_by_test_id("stage")
    expect(stage).to_contain_text("Standby", timeout=LIMIT_MS)
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("control-holder")).to_have_text("You have control")
    page.get_by_test_id("enable").click()
    expect(stage).to_contain_text("Ready", timeout=LIMIT_MS)
    expect(page.get_by_test_id("drive-state-x")).to_contain_text("operation enabled")
    picture(page, "operator_1_enabled")

    page.goto(f"{table}/motion")
    page.get_by_test_id("program-choice").click()
    page.get_by_role("option", name="circle.toml").click()
    expect(page.get_by_test_id("program-verdict")).to_contain_text("within the limits")
    page.get_by_test_id("load-program").click()
    expect(page.get_by_test_id("program-name")).to_have_text("circle.toml", timeout=LIMIT_MS)
    run_circle(page, table)
    picture(page, "operator_2_circle")

    page.goto(f"{table}/friction")
    before_um = error_of(page, "x")
    picture(page, "operator_3_error")
    page.get_by_test_id("start-learning").click()
    expect(stage).to_contain_text("Learning", timeout=LIMIT_MS)
    expect(page.get_by_test_id("learning-best")).to_contain_text(re.compile(r"\d"), timeout=LIMIT_MS)
    picture(page, "operator_4_learning")
    expect(page.get_by_test_id("version-x")).to_contain_text("version 1", timeout=LIMIT_MS)
    expect(stage).to_contain_text("Ready", timeout=LIMIT_MS)

    run_circle(page, table)
    page.goto(f"{table}/friction")
    after_um = error_of(page, "x")
    picture(page, "operator_5_learned")
    assert after_um < before_um

    page.goto(f"{table}/motion")
    expect(page.get_by_test_id("start")).to_be_enabled(timeout=LIMIT_MS)
    page.get_by_test_id("start").click()
    expect(stage).to_contain_text("Running", timeout=LIMIT_MS)
    page.get_by_test_id("stop").click()
    expect(stage).to_contain_text("Standby", timeout=LIMIT_MS)
    page.goto(table)
    expect(page.get_by_test_id("stage-reason")).to_have_text(re.compile("quick stop by"))
    expect(page.get_by_test_id("fault")).to_have_count(0)
    picture(page, "operator_6_stopped")
