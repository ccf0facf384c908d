"""Page and PDF of a report: the same content, whole or not at all, and nothing from elsewhere."""

import html
import json
import re
import subprocess
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser_program import CHROMIUM
from synthetic_recording import SETUP_KEYS, circle, reversal, write_recording
from typer.testing import CliRunner

from servo_ctrl.cli.main import app
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.metrology.contour_error import CONTOUR_FILE
from servo_ctrl.report.content import Report, ReportPicture, ReportTable
from servo_ctrl.report.html_page import page
from servo_ctrl.report.pdf_pages import pdf, sheets_of
from servo_ctrl.report.recorded_run import read_run
from servo_ctrl.report.run_section import contour_section
from servo_ctrl.report.write import check_free, report_of, write_report

HOSTILE = '<script>document.title="broken"</script> $x_1$ & "more"'


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two turns of a circle with noise, a reversal each quarter, names that mean mischief."""
    columns = circle(lambda a: 2e-6 * np.cos(4 * a) + 1e-7 * np.sin(900 * a), turns=2.5)
    count = len(columns["x.position_command_m"])
    columns["x.force_command_n"] = 60.0 * np.sin(np.arange(count) * 1e-2)
    step = {"label": HOSTILE, "kind": "circle", "steady_first_cycle": 0, "steady_last_cycle": count}
    entries = [reversal("xy"[place % 2], 0.5 * place, (3.0 + place) * 1e-6) for place in range(9)]
    return write_recording(
        tmp_path_factory.mktemp("recording") / "r",
        columns,
        entries,
        segments=[step],
        events=[f"event {number}: {HOSTILE} " + 30 * "long words " for number in range(30)],
    )


@pytest.fixture(scope="module")
def report(recording: Path) -> Report:
    return report_of(read_run(recording))


@pytest.fixture(scope="module")
def whole_page(report: Report) -> str:
    return page(report)


class _Text(HTMLParser):
    """What a page says, without scripts and styles, and what it would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.printed: list[str] = []
        self.fetched: list[str] = []
        self.scripts, self._silent = 0, False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._silent = tag in {"script", "style"}
        self.scripts += tag == "script"
        self.fetched += [str(value) for name, value in attrs if name in {"src", "href"} and value]

    def handle_endtag(self, tag: str) -> None:  # noqa: ARG002  # HTMLParser's
        self._silent = False

    def handle_data(self, data: str) -> None:
        if not self._silent:
            self.printed.append(data)


def read(whole_page: str) -> _Text:
    parser = _Text()
    parser.feed(whole_page)
    return parser


def cells(report: Report) -> set[str]:
    tables = [part for section in report.sections for part in section.parts if isinstance(part, ReportTable)]
    return {cell for one in tables for row in one.rows for cell in row if cell}


def pictures(report: Report) -> list[ReportPicture]:
    return [part for section in report.sections for part in section.parts if isinstance(part, ReportPicture)]


def test_the_page_holds_every_cell_and_picture_and_fetches_nothing(report: Report, whole_page: str) -> None:
    found = read(whole_page)
    assert cells(report) <= set(found.printed)
    assert all(link.startswith("#") for link in found.fetched)
    assert found.scripts == 3  # data, plotly.js, ours: none came in with a name
    (data,) = re.findall(r'id="figures">(.*?)</script>', whole_page, re.DOTALL)
    assert list(json.loads(data)) == [picture.name for picture in pictures(report)]
    assert "default-src 'none'" in whole_page


def test_the_pdf_has_the_text_of_the_page(report: Report) -> None:
    sheets = sheets_of(report)
    printed = " ".join(text.get_text() for figure in sheets for text in figure.texts)
    words = set(printed.split())
    missing = [cell for cell in cells(report) if not set(cell.split()) <= words]
    assert [cell for cell in missing if max(map(len, cell.split())) < 20] == []
    assert sum(len(figure.axes) for figure in sheets) == len(pictures(report))


def test_nothing_is_written_beyond_a_sheet_and_no_picture_over_another(report: Report) -> None:
    for figure in sheets_of(report):
        figure.draw_without_rendering()
        for text in figure.texts:
            box = text.get_window_extent()
            assert box.x0 >= 0.0, text.get_text()
            assert box.x1 <= figure.bbox.x1, text.get_text()
            assert box.y0 >= 0.0, text.get_text()
        edges = sorted((axes.get_position().y0, axes.get_position().y1) for axes in figure.axes)
        assert all(below[1] < above[0] for below, above in pairwise(edges))


def test_it_can_be_read_without_colours(report: Report, whole_page: str) -> None:
    (data,) = re.findall(r'id="figures">(.*?)</script>', whole_page, re.DOTALL)
    drawn = json.loads(data)
    several = [picture for picture in pictures(report) if len(picture.series) > 1]
    assert several
    for picture in several:
        traces = drawn[picture.name]["data"][: len(picture.series)]
        looks = {
            json.dumps([_without_colour(trace.get(key)) for key in ("line", "marker")]) for trace in traces
        }
        assert len(looks) == len(traces), picture.name


def _without_colour(style: Any) -> Any:
    if not isinstance(style, dict):
        return style
    return {key: _without_colour(value) for key, value in style.items() if key != "color"}


@pytest.mark.skipif(CHROMIUM is None, reason="needs chromium (make system)")
def test_a_browser_draws_all_and_asks_for_nothing(whole_page: str, report: Report, tmp_path: Path) -> None:
    assert CHROMIUM
    file = tmp_path / "report.html"
    file.write_text(whole_page, encoding="utf-8")
    quiet = ["--disable-background-networking", "--disable-component-update", "--no-first-run"]
    done = subprocess.run(
        [
            *(CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", *quiet, "--enable-logging=stderr"),
            *("--host-resolver-rules=MAP * ~NOTFOUND", f"--user-data-dir={tmp_path / 'profile'}"),
            *("--virtual-time-budget=20000", "--dump-dom", file.as_uri()),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert 'data-ready="yes"' in done.stdout
    assert done.stdout.count("js-plotly-plot") >= len(pictures(report))
    assert f"<title>{html.escape(report.title)}</title>" in done.stdout
    assert "Content Security Policy" not in done.stderr
    assert "Uncaught" not in done.stderr


def recorded(tmp_path: Path, **header: Any) -> Path:
    return write_recording(tmp_path / "r", {"segment": np.zeros(50)}, **header)


def test_the_command_writes_both_and_writes_over_nothing_unasked(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "report"
    command = ["report", str(recorded(tmp_path)), "--out", str(out)]
    first = CliRunner().invoke(app, command)
    assert first.exit_code == 0, first.output
    assert "completed" in first.output
    assert sorted(path.name for path in out.iterdir()) == ["report.html", "report.pdf"]
    assert (out / "report.pdf").read_bytes().startswith(b"%PDF-")
    (out / "report.pdf").write_bytes(b"mine")
    again = CliRunner().invoke(app, command)
    assert isinstance(again.exception, ServoCtrlError)
    assert "--force" in str(again.exception)
    assert (out / "report.pdf").read_bytes() == b"mine"
    check_free(out, force=True)
    write_report(out, "page", b"document")
    assert [(out / name).read_bytes() for name in ("report.html", "report.pdf")] == [b"page", b"document"]


def test_a_report_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "report.pdf").mkdir()
    with pytest.raises(ServoCtrlError, match=re.escape(str(tmp_path / "report.pdf"))):
        write_report(tmp_path, "page", b"document")
    assert [path.name for path in tmp_path.iterdir()] == ["report.pdf"]


def test_a_recording_that_lacks_rows_is_reported_with_what_it_lacks(tmp_path: Path) -> None:
    assert {"not recorded", "25 rows lost"} <= cells(
        report_of(read_run(recorded(tmp_path, loss="25 rows lost")))
    )


def test_a_recording_of_an_earlier_version_is_reported_on_as_far_as_it_goes(tmp_path: Path) -> None:
    directory = recorded(tmp_path)
    header = json.loads((directory / "recording.json").read_text(encoding="utf-8"))
    kept = {key: value for key, value in header.items() if key not in SETUP_KEYS}
    (directory / "recording.json").write_text(json.dumps(kept), encoding="utf-8")
    old = report_of(read_run(directory))
    printed = [*cells(old), *(text for section in old.sections for text in section.text)]
    assert "not recorded" in printed
    assert any("earlier version" in text for text in printed)
    assert any("reversals.jsonl" in text for text in printed)
    assert pdf(old).startswith(b"%PDF-")


def test_a_learned_waveform_in_use_is_reported_with_its_version(report: Report) -> None:
    assert "on, version 2 of 2026-11-20 10:00:00 UTC" in cells(report)


def test_an_unusable_recording_is_refused_with_the_reason(tmp_path: Path) -> None:
    nothing = np.full(50, np.nan)
    silent = {f"{axis}.position_command_m": nothing for axis in "xy"}
    cases: list[tuple[Path, str]] = [
        (tmp_path / "none", "is not a recording"),
        (recorded(tmp_path / "a", format=2), "format"),
        (recorded(tmp_path / "b", period_s="fast"), "period_s"),
        (recorded(tmp_path / "c", axes=["x", "y", "z"]), "no column z."),
        (write_recording(tmp_path / "d", silent, reason="drive 1 did not answer"), "drive 1 did not answer"),
        (write_recording(tmp_path / "e", {"segment": np.zeros(0)}), "no rows"),
    ]
    broken = recorded(tmp_path / "f")
    (broken / "reversals.jsonl").write_text('{"axis": 3}\n', encoding="utf-8")
    cases.append((broken, "line 1 is not a reversal"))
    for directory, reason in cases:
        done = CliRunner().invoke(app, ["report", str(directory), "--out", str(tmp_path / "out")])
        assert isinstance(done.exception, ServoCtrlError), directory
        assert reason in str(done.exception)
        assert str(directory) in str(done.exception)
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("text", ["[" * 100_000, "9" * 5000, "{", "[]"])
def test_a_contour_file_that_is_none_leaves_its_section_out(
    recording: Path, tmp_path: Path, text: str
) -> None:
    run = read_run(recording)._replace(directory=tmp_path)
    (tmp_path / CONTOUR_FILE).write_text(text)
    assert contour_section(run) is None
