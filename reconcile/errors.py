"""The error of reconcile: one line that names file, place, reason and remedy."""

from pathlib import Path


def in_words(error: BaseException) -> str:
    """Return the message of a library's error in one line; its type where it has no message."""
    return " ".join(str(error).split()) or type(error).__name__


class ReconcileError(Exception):
    """Data or a model cannot be used.

    `file` is the file as the user named it, `where` the column, row or time inside it (empty for the whole
    file), `reason` what is wrong, `remedy` what to do about it (empty where the reason implies it).
    """

    def __init__(self, file: Path | str, where: str, reason: str, remedy: str = "") -> None:
        self.file = str(file)
        self.where = where
        self.reason = reason
        self.remedy = remedy
        place = ": ".join(part for part in (self.file, where, reason) if part)
        super().__init__("; ".join(part for part in (place, remedy) if part))
