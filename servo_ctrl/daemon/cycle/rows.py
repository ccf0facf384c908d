"""Distributes each cycle's row to page, stream, and to monitoring or a learning stroke.

The recording takes it as it lies in memory (`MachineController.keep_row`).
"""

from collections.abc import Callable

RowSink = Callable[[list[float]], None]


class RowRouter:
    """`stroke` takes the rows of a learning stroke, `observe` all others; the other sinks take every row."""

    def __init__(self, observe: RowSink) -> None:
        self.page: RowSink | None = None
        self.stream: RowSink | None = None
        self.stroke: RowSink | None = None
        self._observe = observe

    def take(self, values: list[float]) -> None:
        """Pass the row of this cycle to its sinks."""
        for sink in (self.page, self.stream, self.stroke or self._observe):
            if sink is not None:
                sink(values)
