"""Assembles a report, and writes its two files: both or none, over another report only with --force."""

from pathlib import Path

from servo_ctrl.errors import ServoCtrlError, reason_of
from servo_ctrl.files.whole_file import write_whole
from servo_ctrl.report.axis_section import axis_sections
from servo_ctrl.report.circle_section import circle_section
from servo_ctrl.report.content import Report
from servo_ctrl.report.positioning_section import positioning_section
from servo_ctrl.report.recorded_run import RecordedRun
from servo_ctrl.report.reversal_section import reversal_section
from servo_ctrl.report.run_section import contour_section, run_sections, verdict

HTML_FILE, PDF_FILE = "report.html", "report.pdf"


class ReportError(ServoCtrlError):
    """A report cannot be written; the message names the file."""


def check_free(directory: Path, *, force: bool) -> None:
    """Raise ReportError if a report exists that must not be replaced."""
    existing = [name for name in (HTML_FILE, PDF_FILE) if (directory / name).exists()]
    if existing and not force:
        raise ReportError(
            f"{directory / existing[0]}: is there already; name another directory or use --force"
        )


def write_report(directory: Path, page: str, document: bytes) -> None:
    """Write both files. Raises ReportError and then leaves the earlier files."""
    html, pdf = directory / HTML_FILE, directory / PDF_FILE

    def write_both(temporary: Path) -> None:
        temporary.write_text(page, encoding="utf-8")
        write_whole(pdf, lambda part: part.write_bytes(document))

    try:
        directory.mkdir(parents=True, exist_ok=True)
        write_whole(html, write_both)
    except OSError as error:
        place = error.filename or directory
        raise ReportError(f"{place}: cannot be written: {reason_of(error)}") from None


def report_of(run: RecordedRun) -> Report:
    """Evaluate a recorded run into a report."""
    word, good, sentence = verdict(run.header)
    overview, *by_axis = axis_sections(run)
    special = (circle_section(run), positioning_section(run), contour_section(run))
    first, events, setup = run_sections(run)
    sections = [first, events, overview, *(one for one in special if one), reversal_section(run)]
    program = (run.header.program or "no program").rpartition("/")[2]
    return Report(
        title=f"{run.header.machine}: {program}, {run.header.started[:16].replace('T', ' ')} UTC",
        verdict=word,
        good=good,
        sentence=sentence,
        sections=(*sections, *by_axis, setup),
    )
