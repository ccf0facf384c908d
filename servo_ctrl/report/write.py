"""The two files of a report: both or none of them, and never over another report unasked."""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.telemetry.parquet import reason_of, write_whole

if TYPE_CHECKING:
    from pathlib import Path

HTML_FILE, PDF_FILE = "report.html", "report.pdf"


class ReportError(ServoCtrlError):
    """A report that cannot be written; the message names the file."""


def check_free(directory: Path, *, force: bool) -> None:
    """Raise ReportError when there is a report already that may not be replaced."""
    there = [name for name in (HTML_FILE, PDF_FILE) if (directory / name).exists()]
    if there and not force:
        raise ReportError(f"{directory / there[0]}: is there already; name another directory or use --force")


def write_report(directory: Path, page: str, document: bytes) -> None:
    """Write both. Raises ReportError; what was there before stays then."""
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
