"""Where the row of a cycle goes: to the recording, and to monitoring or to the stroke being learned."""

from collections.abc import Callable

RowSink = Callable[[list[float]], None]


class RowRouter:
    """`observe` takes the rows of production, `stroke` those of a stroke, the others every row."""

    def __init__(self, observe: RowSink) -> None:
        self.record: RowSink | None = None
        self.page: RowSink | None = None
        self.stream: RowSink | None = None
        self.stroke: RowSink | None = None
        self._observe = observe

    def take(self, values: list[float]) -> None:
        """Pass on the row of this cycle."""
        for sink in (self.record, self.page, self.stream, self.stroke or self._observe):
            if sink is not None:
                sink(values)
