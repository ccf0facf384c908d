"""Where the row of a cycle goes: to the recording, and to monitoring or to the stroke being learned."""

from collections.abc import Callable


class RowRouter:
    """`observe` takes the rows of production, `stroke` those of a stroke, the others every row."""

    def __init__(self, observe: Callable[[list[float]], None]) -> None:
        self.record: Callable[[list[float]], None] | None = None
        self.look_on: Callable[[list[float]], None] | None = None
        self.stream: Callable[[list[float]], None] | None = None
        self.stroke: Callable[[list[float]], None] | None = None
        self._observe = observe

    def take(self, values: list[float]) -> None:
        """The row of this cycle."""
        if self.record is not None:
            self.record(values)
        if self.look_on is not None:
            self.look_on(values)
        if self.stream is not None:
            self.stream(values)
        if self.stroke is None:
            self._observe(values)
        else:
            self.stroke(values)
