"""What reconcile says when it cannot go on: one line that names the file, the place and the remedy."""

from pathlib import Path


def in_words(error: BaseException) -> str:
    """What a library says of a file, in one line; its kind where it says nothing."""
    return " ".join(str(error).split()) or type(error).__name__


class ReconcileError(Exception):
    """Data or a model that cannot be used.

    `file` is the file as the user named it, `where` the column, row or time inside it (empty for the whole
    file), `reason` what is wrong, `remedy` what to do about it (empty where the reason says it).
    """

    def __init__(self, file: Path | str, where: str, reason: str, remedy: str = "") -> None:
        self.file = str(file)
        self.where = where
        self.reason = reason
        self.remedy = remedy
        place = ": ".join(part for part in (self.file, where, reason) if part)
        super().__init__("; ".join(part for part in (place, remedy) if part))
