"""Progress of `reconcile watch`, as its caller receives it."""

from typing import Protocol


class ProgressCallback(Protocol):
    """Receives one line of progress."""

    def __call__(self, text: str, /, *, lasting: bool) -> None:
        """Show `text`: for a moment, or so that it stays to be read if `lasting`."""


def silent(_text: str, /, *, lasting: bool) -> None:
    """Discard a line of progress."""
