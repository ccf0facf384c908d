from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from eventually import eventually
from learned_examples import LEARNED, table_in
from playwright.sync_api import expect
from stub_status import first_status
from waveform_examples import example_waveform

from servo_ctrl.commands.local_codec import to_plain
from servo_ctrl.learned.store import LearnedStore, WaveformStore

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from page_server import Stub
    from playwright.sync_api import Page

FIRST = to_plain(first_status())


def learning(**fields: Any) -> dict[str, Any]:
    return {**FIRST["learning"], **fields}


def axis_x(**fields: Any) -> list[dict[str, Any]]:
    """The axes of the status, with these fields of x."""
    x, y = FIRST["axes"]
    return [{**x, **fields}, y]


def take_control(page: Page) -> None:
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("control-holder")).to_have_text("You have control")


def of_axes(stub: Stub) -> list[tuple[str, str]]:
    """Commands and axes that were asked for."""
    return [(request["command"], request["axis"]) for request in stub.requests()]


def curves(page: Page, name: str) -> list[str]:
    """Names of the curves in a plot."""
    names: list[str] = page.get_by_test_id(name).evaluate(
        "plot => (plot.data ?? plot.querySelector('.js-plotly-plot')?.data ?? [])"
        ".filter(one => one.mode !== 'markers').map(one => one.name)"
    )
    return names


@pytest.fixture
def stored(tmp_path: Path, stub: Stub) -> list[int]:
    """Three versions of axis x, the last one in use, and a waveform."""
    machine = table_in(tmp_path / "table")
    store = LearnedStore(tmp_path / "table" / "learned", machine)
    versions = [store.add("x", LEARNED._replace(before_m=k * 1e-6), {}).version for k in (7, 8, 9)]
    waveform = {
        **FIRST["axes"][0]["waveform"],
        "version": WaveformStore(store.directory, machine).add("x", example_waveform(), {}).version,
    }
    stub.link(hello={"machine_file": str(machine.source), "learned_dir": str(store.directory)})
    stub.status(axes=axis_x(version=3, waveform=waveform))
    return versions


def test_an_odd_last_reversal_and_learning_due_are_shown(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit("/friction")
    expect(page.get_by_test_id("j-x")).to_have_text("2.00 µm")
    expect(page.get_by_test_id("due-x")).to_contain_text("settled")
    last = {**FIRST["axes"][0]["last"], "error_mean_m": 4.25e-6, "contour_peak_m": 7.5e-6}
    stub.status(axes=axis_x(learning_due=True, last=last, reversals=96))
    expect(page.get_by_test_id("required-x")).to_contain_text("the last one is an outlier: 4.25 µm")
    expect(page.get_by_test_id("j-x")).to_have_text(
        "2.00 µm"
    )  # the median of the reversals that come meanwhile
    expect(page.get_by_test_id("contour_peak_m-x")).to_have_text("7.50 µm")
    expect(page.get_by_test_id("reversals-x")).to_have_text("96")
    expect(page.get_by_test_id("due-x")).to_contain_text("learning due")
    expect(page.get_by_test_id("due-y")).to_contain_text("settled")


def test_new_reversals_are_drawn_in_the_chosen_indicator(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit("/friction")
    axis_title = page.get_by_test_id("indicator-plot").locator(".ytitle")
    expect(axis_title).to_have_text("J (mean error) (µm)")
    page.get_by_role("button", name="contour peak").click()
    expect(axis_title).to_have_text("contour peak (µm)")
    eventually(lambda: curves(page, "indicator-plot"), ["axis x", "axis y"])
    page.wait_for_function(
        "document.querySelector('[data-testid=indicator-plot]').data?.every(one => one.x.length > 0) ?? true"
    )


def test_a_learning_run_is_started_shown_paused_resumed_and_aborted(
    visit: Callable[..., Page], picture: Callable[[Page, str], None], stub: Stub
) -> None:
    page = visit("/friction")
    start, pause, resume, abort = (
        page.get_by_test_id(f"{word}-learning") for word in ("start", "pause", "resume", "abort")
    )
    expect(start).to_be_disabled()
    expect(start).to_have_accessible_description(
        "Nobody has control. Take it first, in the head of the page."
    )
    take_control(page)
    start.click()
    expect(pause).to_be_disabled()
    expect(pause).to_have_accessible_description("there is no learning to pause; learning is idle")
    run = learning(
        state="running",
        axis="x",
        stage="coarse",
        strokes_done=12,
        strokes_total=48,
        progress=0.25,
        remaining_s=1500.0,
        acceleration_m_s2=0.008,
        best_m=2.5e-6,
    )
    stub.status(learning=run)
    expect(page.get_by_test_id("learning-state")).to_have_text("Axis x: running")
    expect(page.get_by_test_id("learning-strokes")).to_have_text("12 of 48")
    expect(page.get_by_test_id("learning-remaining")).to_have_text("25 min 00 s")
    expect(page.get_by_test_id("learning-stage")).to_have_text("amplitude, coarse")
    expect(page.get_by_test_id("learning-best")).to_have_text("2.50 µm at 8.0 mm/s²")
    expect(page.get_by_test_id("learning-progress")).to_have_attribute("aria-valuenow", "0.25")
    expect(start).to_be_disabled()
    picture(page, "friction-learning")
    pause.click()
    stub.status(learning={**run, "state": "paused"})
    resume.click()
    abort.click()
    stub.status(learning={**run, "state": "failed", "reason": "following error of axis x"})
    expect(page.get_by_test_id("learning-reason")).to_have_text("following error of axis x")
    expect(start).to_be_enabled()
    commands = ["start_learning", "pause_learning", "resume_learning", "abort_learning"]
    eventually(stub.commands, commands)
    assert stub.requests()[0]["axis"] == "x"


def test_a_switch_sends_its_command_and_shows_the_state_of_the_machine(
    visit: Callable[..., Page], stub: Stub
) -> None:
    stub.link(answers={"disable_compensation": {"accepted": False, "reason": "the axis is being learned"}})
    page = visit("/friction")
    take_control(page)
    switch = page.get_by_test_id("compensation-x")
    expect(switch).to_have_attribute("aria-checked", "true")
    switch.click()
    expect(page.get_by_text("the axis is being learned")).to_be_visible()
    expect(switch).to_have_attribute("aria-checked", "true")
    page.get_by_test_id("observer-y").click()
    y = {**FIRST["axes"][1], "observer_enabled": True}
    stub.status(axes=[FIRST["axes"][0], y])
    expect(page.get_by_test_id("observer-y")).to_have_attribute("aria-checked", "true")
    eventually(lambda: of_axes(stub), [("disable_compensation", "x"), ("enable_observer", "y")])


def test_settings_are_converted_from_page_units_to_si(visit: Callable[..., Page], stub: Stub) -> None:
    page = visit("/friction")
    take_control(page)
    required = page.get_by_test_id("required")
    expect(required).to_have_value("3")
    required.fill("soon")
    page.get_by_test_id("set-required").click()
    expect(page.get_by_text('"soon" is not a number')).to_be_visible()
    required.fill("3,5")
    required.press("Enter")
    page.get_by_test_id("learner").click()
    page.get_by_role("option", name="screw").click()
    page.get_by_test_id("adaptation").click()
    wanted = [("required_m", pytest.approx(3.5e-6)), ("learner", "screw"), ("adaptation", True)]
    eventually(lambda: [(one["setting"], one["value"]) for one in stub.requests()], wanted)


@pytest.mark.usefixtures("stored")
def test_a_version_is_compared_with_the_one_in_use_and_rolled_back_when_confirmed(
    visit: Callable[..., Page], picture: Callable[[Page, str], None], stub: Stub
) -> None:
    page = visit("/friction")
    take_control(page)
    rows = page.get_by_test_id("versions").locator("tbody tr")
    expect(rows).to_have_count(3)
    expect(rows.nth(0)).to_contain_text("3, in use")
    expect(rows.nth(0)).to_contain_text("9.00 → 1.12 µm")
    eventually(lambda: curves(page, "duration-plot"), ["version 3, in use"])
    rows.nth(2).get_by_role("checkbox").click()
    both = ["version 3, in use", "version 1"]
    eventually(lambda: curves(page, "duration-plot"), both)
    eventually(lambda: curves(page, "amplitude-plot"), both)
    picture(page, "friction")
    back = page.get_by_test_id("roll-back")
    back.click()
    page.get_by_test_id("leave-it").click()
    back.click()
    expect(page.get_by_text("becomes version 2")).to_be_visible()
    page.get_by_test_id("confirm").click()
    eventually(lambda: of_axes(stub), [("roll_back", "x")])
    page.get_by_test_id("learned-axis").get_by_role("button", name="y").click()
    expect(page.get_by_test_id("learned-problem")).to_contain_text(
        "Version 2 is in use, but there is none in"
    )
    expect(back).to_be_disabled()
    page.get_by_test_id("learned-axis").get_by_role("button", name="x").click()
    page.get_by_test_id("learned-kind").get_by_role("button", name="waveform").click()
    eventually(lambda: curves(page, "duration-plot"), ["50.0 mm/s²", "400.0 mm/s²"])
    expect(back).to_be_enabled()
    picture(page, "friction-waveform")


@pytest.mark.usefixtures("stored")
def test_nothing_is_wider_than_a_telephone(
    visit: Callable[..., Page], picture: Callable[[Page, str], None]
) -> None:
    page = visit("/friction", width=360, dark=True)
    expect(page.get_by_test_id("versions")).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    picture(page, "friction-narrow")


def test_compensations_are_shown_suspended_while_a_tuning_moves_the_axis(
    visit: Callable[..., Page], stub: Stub
) -> None:
    page = visit("/friction")
    stub.status(axes=axis_x(observer_enabled=True))
    expect(page.get_by_test_id("suspended-x")).to_be_hidden()
    stub.status(axes=axis_x(observer_enabled=True, compensation_suspended=True))
    expect(page.get_by_test_id("suspended-x")).to_contain_text("suspended")
    expect(page.get_by_test_id("suspended-y")).to_be_hidden()
    stub.status(axes=axis_x(observer_enabled=True))
    expect(page.get_by_test_id("suspended-x")).to_be_hidden()
