from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect
from simulated_table import table_directory

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from page_server import Stub
    from playwright.sync_api import Page

MARGINS = {
    "stable": True,
    "sensitivity_peak": 1.57,
    "peak_hz": 31.0,
    "phase_margin_deg": 41.5,
    "gain_margin_db": None,
    "crossover_hz": 12.0,
    "compliance_m_n": 7.8e-7,
    "step_peak_m": 4.71e-5,
    "step_settling_s": None,
}
FIGURES = {
    "machine": "xy_table",
    "axis": "x",
    "stated_ms": 2.0,
    "measured_ms": 2.013,
    "proved": True,
    "proposed": {"control": {"kp_1_s": 61.5}, "notch": {"enabled": False}},
    "before": MARGINS,
    "after": {**MARGINS, "sensitivity_peak": 1.998, "step_peak_m": 2.49e-5, "step_settling_s": 0.078},
    "notes": ["with 70 N the coherence is 0.45 only (median over the lines)"],
}
HZ = [10.0**exponent for exponent in (0.0, 0.5, 1.0, 1.5, 2.0, 2.5)]


def response(name: str, gain: float) -> dict[str, object]:
    """A double integrator with a delay."""
    magnitude, phase = [gain / hz**2 for hz in HZ], [-180.0 - 0.3 * hz for hz in HZ]
    return {"name": name, "frequency_hz": HZ, "magnitude": magnitude, "phase_deg": phase}


CURVES = {
    "plant": [response("motor, measured", 4e-4), response("scale, model", 3e-4)],
    "loop": [response("before", 80.0), response("after", 200.0), response("after, measured", 210.0)],
}


def write(directory: Path, figures: object, curves: object = None) -> None:
    directory.mkdir(parents=True)
    (directory / "tune.json").write_text(json.dumps(figures), encoding="utf-8")
    if curves is not None:
        (directory / "bode.json").write_text(json.dumps(curves), encoding="utf-8")


def serve_machine(stub: Stub, directory: Path) -> None:
    stub.link(hello={"machine_file": str(directory / "controller.toml")})


def test_the_page_shows_proposal_margins_proof_and_bode_plots(
    visit: Callable[..., Page], stub: Stub, tmp_path: Path, picture: Callable[[Page, str], None]
) -> None:
    write(tmp_path / "tuned" / "x", FIGURES, CURVES)
    serve_machine(stub, tmp_path)
    page = visit("/tuning")
    expect(page.get_by_test_id("tuning-state")).to_contain_text("proved on the machine")
    expect(page.get_by_test_id("tuning-ms")).to_contain_text("Ms 2.01 was measured")
    expect(page.get_by_test_id("proposed")).to_contain_text("control.kp_1_s61.5")
    expect(page.get_by_test_id("proposed")).to_contain_text("notch.enabledno")
    margins = page.get_by_test_id("margins").get_by_role("row")
    expect(margins.nth(2)).to_have_text("Ms1.572")
    expect(margins.nth(5)).to_have_text("gain margin, dB——")
    expect(margins.nth(7)).to_have_text("compliance, µm/N0.780.78")
    expect(page.get_by_test_id("indicators").get_by_role("row").nth(2)).to_contain_text("—78 ms")
    expect(page.get_by_text("the coherence is 0.45 only")).to_be_visible()
    curves = {"loop-size": 3, "loop-phase": 3, "sensitivity": 3, "plant-size": 2, "plant-phase": 2}
    for mark, number in curves.items():
        expect(page.get_by_test_id(mark).locator(".scatterlayer .trace")).to_have_count(number)
    picture(page, "tuning")


def test_a_proposal_that_was_not_proved_warns_and_a_damaged_file_is_named(
    visit: Callable[..., Page], stub: Stub, tmp_path: Path, picture: Callable[[Page, str], None]
) -> None:
    serve_machine(stub, tmp_path)
    page = visit("/tuning", width=360, dark=True)
    expect(page.get_by_test_id("no-tuning")).to_contain_text(str(tmp_path))
    write(tmp_path / "first", {**FIGURES, "proved": False})
    page.get_by_role("button", name="Search for tunings again").click()
    expect(page.get_by_test_id("tuning-state")).to_contain_text("not proved")
    expect(page.get_by_test_id("tuning-result")).to_contain_text("report.html")
    picture(page, "tuning-narrow")
    for table in ("proposed", "margins", "indicators"):
        wide, shown = page.get_by_test_id(table).evaluate("table => [table.scrollWidth, table.clientWidth]")
        assert wide <= shown, f"{table} is cut off"
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    (tmp_path / "first" / "tune.json").write_text('{"machine": 3}', encoding="utf-8")
    page.reload()
    expect(page.get_by_test_id("tuning-problem")).to_contain_text("tune.json: machine:")


def simulated_machine(stub: Stub, directory: Path) -> None:
    for name in ("controller.toml", "plant.toml"):
        (directory / name).write_text("", encoding="utf-8")
    serve_machine(stub, directory)


def test_a_tuning_on_the_simulator_shows_its_steps_and_then_its_result(
    visit: Callable[..., Page], stub: Stub, tmp_path: Path, picture: Callable[[Page, str], None]
) -> None:
    simulated_machine(stub, tmp_path)
    page = visit("/tuning")
    page.get_by_test_id("tune-ms").fill("1.5")
    page.get_by_test_id("run-tuning").click()
    expect(page.get_by_test_id("job-step")).to_have_text("starting hil-sim")
    (tmp_path / "step0").touch()
    expect(page.get_by_test_id("job-step")).to_have_text("plant: 50 kg")
    expect(page.get_by_test_id("job-progress")).to_have_attribute("aria-valuenow", "0.5")
    picture(page, "tuning-on-the-simulator")
    (tmp_path / "step1").touch()
    expect(page.get_by_test_id("job-state")).to_contain_text("done")
    expect(page.get_by_test_id("tuning-state")).to_contain_text("proved on the simulator")
    expect(page.get_by_test_id("tuning-ms")).to_contain_text("1.5 was stated")
    assert stub.requests() == [], "the controller was asked for nothing"


def test_a_tuning_on_the_simulator_can_be_cancelled_by_another_browser(
    visit: Callable[..., Page], stub: Stub, tmp_path: Path
) -> None:
    simulated_machine(stub, tmp_path)
    page, other = visit("/tuning"), visit("/tuning")
    page.get_by_test_id("run-tuning").click()
    expect(other.get_by_test_id("job-state")).to_contain_text("running")
    other.get_by_test_id("run-tuning").click()
    expect(other.get_by_text("a tuning is running already")).to_be_visible()
    other.get_by_test_id("job-cancel").click()
    expect(page.get_by_test_id("job-state")).to_contain_text("cancelled")


def test_without_a_model_of_the_machine_nothing_is_tuned(
    visit: Callable[..., Page], stub: Stub, tmp_path: Path
) -> None:
    simulated_machine(stub, tmp_path)
    (tmp_path / "plant.toml").unlink()
    page = visit("/tuning")
    page.get_by_test_id("run-tuning").click()
    expect(page.get_by_text("plant.toml: there is no such file, so nothing can be simulated")).to_be_visible()


@pytest.mark.timeout(1200)
def test_the_real_program_tunes_a_simulated_table_and_the_page_shows_what_it_proves(
    visit: Callable[..., Page], stub: Stub, tmp_path: Path, picture: Callable[[Page, str], None]
) -> None:
    table = table_directory(tmp_path / "table", {}, {})
    machine_file = (table / "controller.toml").read_bytes()
    serve_machine(stub, table)
    page = visit("/tuning")
    page.get_by_test_id("tune-ms").fill("1.8")
    page.get_by_test_id("run-tuning").click()
    expect(page.get_by_test_id("job-state")).to_contain_text("done", timeout=1_000_000)
    expect(page.get_by_test_id("tuning-state")).to_contain_text("proved on the simulator")
    measured = re.match(r"Ms (\S+) was measured", page.get_by_test_id("tuning-ms").inner_text())
    assert measured is not None
    assert 1.2 < float(measured[1]) <= 1.8 * 1.03, "the plant that was simulated keeps it"
    for key in ("control.kp_1_s", "control.kv_n_s_m", "control.acceleration_feedforward_kg"):
        expect(page.get_by_test_id("proposed")).to_contain_text(key)
    curves = {"loop-size": 4, "loop-phase": 4, "sensitivity": 3, "plant-size": 4, "plant-phase": 4}
    for mark, number in curves.items():
        expect(page.get_by_test_id(mark).locator(".scatterlayer .trace")).to_have_count(number)
    picture(page, "tuned-by-the-real-program")
    assert stub.requests() == [], "the controller was asked for nothing"
    assert (table / "controller.toml").read_bytes() == machine_file


def test_the_machine_is_tuned_by_who_has_control_and_has_confirmed_it(
    visit: Callable[..., Page], stub: Stub, tmp_path: Path, picture: Callable[[Page, str], None]
) -> None:
    simulated_machine(stub, tmp_path)
    page = visit("/tuning")
    tune = page.get_by_test_id("tune-machine")
    expect(tune).to_be_disabled()
    expect(tune).to_have_attribute("title", re.compile("Nobody has control. Take it first"))
    page.get_by_test_id("take-control").click()
    expect(tune).to_be_enabled()
    stub.status(stage="standby")
    expect(tune).to_have_attribute("title", "the machine is standby, not ready")
    stub.status(stage="ready")
    page.get_by_test_id("tune-machine").click()
    expect(page.get_by_text("Move axis x of the machine?")).to_be_visible()
    page.get_by_test_id("leave-it").click()
    expect(page.get_by_text("Move axis x of the machine?")).to_be_hidden()
    page.get_by_test_id("tune-machine").click()
    picture(page, "tune-the-machine")
    page.get_by_test_id("confirm").click()
    expect(page.get_by_test_id("job-step")).to_have_text("starting hil-sim")
    for number in range(2):
        (tmp_path / f"step{number}").touch()
    expect(page.get_by_test_id("tuning-state")).to_contain_text("proved on the machine")


def test_a_tuning_of_the_machine_ends_when_another_takes_control(
    visit: Callable[..., Page], stub: Stub, tmp_path: Path
) -> None:
    simulated_machine(stub, tmp_path)
    page, other = visit("/tuning"), visit("/tuning", another=True)
    page.get_by_test_id("take-control").click()
    page.get_by_test_id("tune-machine").click()
    page.get_by_test_id("confirm").click()
    expect(other.get_by_test_id("job-state")).to_contain_text("running")
    other.get_by_test_id("take-control").click()
    other.get_by_test_id("confirm").click()
    expect(page.get_by_test_id("job-state")).to_contain_text("cancelled")
