from __future__ import annotations

import json
import tomllib
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from page_server import Stub
    from playwright.sync_api import Page

MODEL = '[axis.x.drive]\neds = "drive.eds"\n[axis.x.table]\nmass_kg = 50.0\n'
STEPS = 6


class Files:
    """A machine's directory and its recordings; the diagnosis goes on as `go` says."""

    def __init__(self, directory: Path) -> None:
        self.machine = directory / "machine"
        self.machine.mkdir()
        (self.machine / "plant.toml").write_text(MODEL)
        self.runs = directory / "runs"
        for name in ("monday", "tuesday", "broken"):
            (self.runs / name).mkdir(parents=True)
            header = {"started": f"2026-01-0{len(name)}T10:00:00Z", "program": "circles.toml"}
            (self.runs / name / "recording.json").write_text(json.dumps(header))

    def go(self, steps: int) -> None:
        for number in range(steps):
            (self.machine / f"step{number}").touch()


@pytest.fixture
def files(tmp_path: Path, stub: Stub) -> Iterator[Files]:
    made = Files(tmp_path)
    stub.link(
        hello={
            "machine_file": str(made.machine / "controller.toml"),
            "record_dir": str(made.runs / "tuesday"),
        }
    )
    yield made
    made.go(STEPS)  # whatever is still running ends


def begin(page: Page, *names: str) -> None:
    """Pick recordings, and run."""
    for name in names:
        page.get_by_test_id("recordings").get_by_text(name).click()
    expect(page.get_by_test_id("model")).to_have_value("plant.toml")
    page.get_by_test_id("run-diagnosis").click()


def test_a_diagnosis_outlives_its_browser_and_its_model_is_taken_into_use(
    visit: Callable[..., Page], files: Files, picture: Callable[[Page, str], None]
) -> None:
    page = visit("/reconcile", another=True)
    expect(page.get_by_test_id("run-diagnosis")).to_be_disabled()
    begin(page, "monday", "tuesday")
    expect(page.get_by_test_id("job-state")).to_contain_text("running")
    files.go(3)
    expect(page.get_by_test_id("job-step")).to_have_text("axis x: scale less motor")
    page.context.close()
    page = visit("/reconcile")
    expect(page.get_by_test_id("job-step")).to_have_text("axis x: scale less motor")
    expect(page.get_by_test_id("job-time")).to_contain_text("started by local")
    picture(page, "reconcile-running")
    files.go(STEPS)
    expect(page.get_by_test_id("verdict-sentence")).to_contain_text("leaves out physics")
    finding = page.get_by_test_id("finding")
    expect(finding).to_contain_text("Axis x: Stribeck friction (or Coulomb friction)")
    expect(finding).to_contain_text("confidence 97 %")
    expect(finding).to_contain_text("2 N (1.9 to 2.1)")
    expect(page.get_by_test_id("fit")).to_contain_text("0.25")
    report = page.frame_locator("[data-testid=report-frame]")
    expect(report.locator("#result")).to_have_text("reached the page: no")
    picture(page, "reconcile")
    target = files.machine / "plant.toml"
    page.get_by_test_id("accept-target").fill("plant.toml")
    page.get_by_test_id("accept-model").click()
    expect(page.get_by_text("It is kept under another name")).to_be_visible()
    page.get_by_test_id("leave-it").click()
    assert target.read_text() == MODEL
    page.get_by_test_id("accept-model").click()
    page.get_by_test_id("confirm").click()
    expect(page.get_by_test_id("accepted")).to_contain_text("The old one is plant.")
    assert tomllib.loads(target.read_text())["axis"]["x"]["table"]["mass_kg"] == 51.5
    kept = [path for path in files.machine.glob("plant.*.toml") if path.read_text() == MODEL]
    assert len(kept) == 1


def test_only_the_files_of_a_diagnosis_can_be_downloaded(visit: Callable[..., Page], files: Files) -> None:
    page = visit("/reconcile")
    begin(page, "monday")
    # what an earlier diagnosis has found is not shown any more
    expect(page.get_by_test_id("job-state")).to_contain_text("running")
    files.go(STEPS)
    expect(page.get_by_test_id("verdict-sentence")).to_be_visible()
    links = page.get_by_test_id("report").get_by_role("link")
    addresses = [str(link.get_attribute("href")) for link in links.all()]
    base = page.url.removesuffix("/reconcile")
    names = [address.split("/")[-1].removesuffix("?language=en") for address in addresses]
    assert names == ["report.html", "verdict.json", "model.toml"]
    for address in addresses:
        answer = page.request.get(base + address)
        assert answer.ok
        assert answer.headers["content-disposition"].startswith("attachment")
    report = base + addresses[0].removesuffix("language=en")
    for language, heading in (("en", "Over time"), ("de", "Über der Zeit"), ("xx", "Over time")):
        answer = page.request.get(f"{report}language={language}")
        assert f"<h3>{heading}</h3>" in answer.text()
        assert answer.headers["content-disposition"] == 'attachment; filename="report.html"'
    folder = addresses[0].rsplit("/", 1)[0]
    for wrong in (
        f"{folder}/next_experiment.toml",
        f"{folder}/..%2freconcile.jsonl",
        "/diagnosis/x/report.html",
    ):
        assert page.request.get(base + wrong).status == 404


def test_only_one_diagnosis_runs_and_any_browser_can_cancel_it(
    visit: Callable[..., Page], files: Files
) -> None:
    page, other = visit("/reconcile"), visit("/reconcile", another=True)
    begin(page, "monday")
    expect(other.get_by_test_id("job-state")).to_contain_text("running")
    begin(other, "tuesday")
    expect(other.get_by_text("a diagnosis is running already")).to_be_visible()
    other.get_by_test_id("job-cancel").click()
    expect(page.get_by_test_id("job-state")).to_contain_text("cancelled")
    expect(page.get_by_test_id("job-reason")).to_contain_text("nothing is half written")
    expect(page.get_by_test_id("job-cancel")).to_be_hidden()


def test_a_recording_can_be_given_by_path_and_a_failure_shows_its_reason(
    visit: Callable[..., Page], files: Files, picture: Callable[[Page, str], None]
) -> None:
    page = visit("/reconcile", width=360, dark=True)
    for path, reason in (
        (files.runs / "nowhere", "there is no such recording"),
        (files.runs / "broken", "has no column time"),
    ):
        page.get_by_test_id("recording-path").fill(str(path))
        page.get_by_test_id("add-recording").click()
        expect(page.get_by_test_id("picked")).to_have_text("1 recording picked")
        page.get_by_test_id("run-diagnosis").click()
        expect(page.get_by_text(reason).first).to_be_visible()
        page.get_by_test_id("recordings").get_by_role("checkbox", checked=True).click()
    expect(page.get_by_test_id("job-state")).to_contain_text("failed")
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    picture(page, "reconcile-narrow")
