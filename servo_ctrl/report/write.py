"""Writes the two files of a report: both or none, and over another report only with --force."""

from pathlib import Path

from servo_ctrl.errors import ServoCtrlError, reason_of
from servo_ctrl.files.whole_file import write_whole

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
