"""What an operator does for accuracy: learn, capture a reversal, overlay turns, diagnose a recording."""

import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from choices import choose
from live_page import go
from operator_moves import LIMIT_MS, run_circle
from playwright.sync_api import Page, expect

from servo_ctrl.recording.reader import load_recording

CAPTURED_ROWS = 100
"""200 ms in cycles of 2 ms."""
REQUIRED_UM = 4.0
"""Of the machine file as it is shipped."""
TURNS = ("without compensation", "learned pulse", "disturbance observer")
REVERSALS_OF_X = (0, 2)
"""Among the four glitches of a turn."""
ATTEMPTS = 3
"""Connections that break one after the other beside other work."""
MINUS = "\N{MINUS SIGN}"
STIFFNESS_N_UM = 120.0
"""Of the drive train of X, which the nominal model believes to be rigid."""
DIAGNOSIS_LIMIT_MS = 900_000
"""A diagnosis gives way to everything else on the computer."""


def error_of(page: Page, axis: str) -> float:
    """J of the last reversals as the Friction page shows it, micrometres."""
    label = page.get_by_test_id(f"j-{axis}")
    expect(label).to_contain_text(re.compile(r"\d"), timeout=LIMIT_MS)
    found = re.search(r"[\d.]+", label.inner_text())
    assert found is not None
    return float(found[0])


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
    expect(scope.get_by_test_id("scope-state")).to_have_text("captured", timeout=LIMIT_MS)
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


def switch_to_the_observer(page: Page, url: str) -> None:
    go(page, f"{url}/friction")
    for axis in ("x", "y"):
        for name, wanted in (("compensation", "false"), ("observer", "true")):
            shown = page.get_by_test_id(f"{name}-{axis}")
            expect(shown).to_be_enabled(timeout=LIMIT_MS)
            if shown.get_attribute("aria-checked") != wanted:
                shown.click()
            expect(shown).to_have_attribute("aria-checked", wanted)


def glitches_um(page: Page, turn: str) -> list[float]:
    """Of a line of the contour's table, whose last figure is the roundness."""
    row = page.get_by_test_id("contour-table").get_by_role("row", name=turn)
    expect(row).to_be_visible(timeout=LIMIT_MS)
    cells = [cell.inner_text().replace(MINUS, "-") for cell in row.get_by_role("cell").all()]
    *glitches, _roundness = [float(text) for text in cells if re.fullmatch(r"[+-]?[0-9.]+", text)]
    assert len(glitches) == 4
    return glitches


def overlay_three_turns(page: Page, url: str, picture: Callable[[Page, str], None]) -> None:
    """The day's circles before and after learning, and one with the observer; only X has learned."""
    switch_to_the_observer(page, url)
    run_circle(page, url)
    go(page, f"{url}/contour")
    found = {turn: glitches_um(page, turn) for turn in TURNS}
    without, pulse, observer = (max(abs(of[i]) for i in REVERSALS_OF_X) for of in found.values())
    assert pulse < 0.8 * without
    assert observer < 0.8 * without
    for chart in ("polar", "quadrants"):
        page.wait_for_function(f"document.querySelector('[data-testid=contour-{chart}]').dataset.frames >= 1")
        drawn = page.evaluate(
            f"getElement(document.querySelector('[data-testid=contour-{chart}]').id.slice(1))"
            ".chart.getOption().series.filter(one => one.name && one.data.length > 100)"
            ".map(one => [one.name, one.color])"
        )
        assert {name for name, _ in drawn} == set(TURNS)
        assert len({colour for _, colour in drawn}) == len(TURNS)
    picture(page, "operator_6_overlaid")


def ask_to_accept(page: Page, target: Path) -> None:
    """Read what the question names, as a visitor does, before it is answered.

    What is typed while the connection is lost reaches nobody, and the page says so; it is typed again then.
    """
    for _ in range(ATTEMPTS):
        page.get_by_test_id("accept-target").fill(target.name)
        page.get_by_test_id("accept-model").click()
        page.get_by_test_id("confirm").wait_for(timeout=LIMIT_MS)
        if page.get_by_role("dialog").get_by_text(f"/{target.name}").is_visible():
            return
        page.get_by_test_id("leave-it").click()
    raise AssertionError(f"the question never named {target.name}")


def diagnose_and_accept(page: Page, url: str, machine: Path, picture: Callable[[Page, str], None]) -> None:
    """The plant's drive trains give way, which the nominal model leaves out; X was moved most of the day.

    The recording is that of the day, which has ended: the one that still runs is what the moment makes it,
    and has too little motion to tell the compliance of X each time.
    """
    go(page, f"{url}/reconcile")
    page.get_by_test_id("recordings").get_by_text(re.compile("^run ")).first.click()
    model = page.get_by_test_id("model")
    model.fill("rigid.toml")
    model.press("Enter")
    page.get_by_test_id("run-diagnosis").click()
    ended = re.compile("done|failed|cancelled")
    expect(page.get_by_test_id("job-state")).to_contain_text(ended, timeout=DIAGNOSIS_LIMIT_MS)
    verdict = page.get_by_test_id("verdict-sentence")
    expect(verdict).to_contain_text("leaves out physics of the catalogue", timeout=LIMIT_MS)
    expect(page.get_by_text("Axis x: drive compliance")).to_be_visible()
    picture(page, "operator_7_diagnosed")
    ask_to_accept(page, machine / "repaired.toml")
    page.get_by_test_id("confirm").click()
    expect(page.get_by_test_id("accepted")).to_contain_text("is the repaired model now", timeout=LIMIT_MS)
    repaired = tomllib.loads((machine / "repaired.toml").read_text(encoding="utf-8"))
    found_n_um = repaired["axis"]["x"]["drive_compliance"]["stiffness_n_um"]
    assert abs(found_n_um - STIFFNESS_N_UM) < 0.1 * STIFFNESS_N_UM
