"""All drives of a machine together: their sequences, told and asked at one go."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from servo_ctrl.axis.drive import Phase, lose, release

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from servo_ctrl.axis import drive
    from servo_ctrl.axis.servo import AxisServo

BRAKED = frozenset({Phase.DISABLING, Phase.OFF, Phase.LOST})


class AxisPlace(NamedTuple):
    """An axis and where its nodes are among the inputs."""

    servo: AxisServo
    drive: int
    scale: int | None
    stop_acceleration_m_s2: float


class Drives:
    """Of the axes at `places`."""

    def __init__(self, places: Sequence[AxisPlace]) -> None:
        self._places = tuple(places)

    @property
    def held_m(self) -> list[float]:
        """Where the axes were taken over."""
        return [place.servo.hold_m for place in self._places]

    @property
    def ready(self) -> bool:
        """Our loops lead all axes."""
        return all(place.servo.ready for place in self._places)

    @property
    def braked(self) -> bool:
        """None brakes any more."""
        return all(place.servo.sequence.phase in BRAKED for place in self._places)

    @property
    def off(self) -> bool:
        """All are without power, as far as anyone can know."""
        return all(place.servo.off for place in self._places)

    def lead(self, change: Callable[[drive.Sequence], drive.Sequence]) -> None:
        """Change the sequences of all that are heard."""
        for place in self._places:
            if place.servo.sequence.phase is not Phase.LOST:
                place.servo.sequence = change(place.servo.sequence)

    def begin_again(self) -> None:
        """Switch all of them on once more."""
        for place in self._places:
            place.servo.begin_again()

    def home(self, servos: Iterable[AxisServo], at_m: Sequence[float]) -> None:
        """Let these look for their homes; the other axes stay at `at_m`."""
        for place, hold_m in zip(self._places, at_m, strict=True):
            place.servo.hold_m = hold_m
        for servo in servos:
            servo.home()

    def lose(self, node: int) -> None:
        """A node that is not heard any more; it may be a drive."""
        self._change(node, lose)

    def take_back(self, node: int) -> None:
        """A node that is heard again; a drive stays without power."""
        self._change(node, release)

    def _change(self, node: int, change: Callable[[drive.Sequence], drive.Sequence]) -> None:
        for place in self._places:
            if place.drive == node:
                place.servo.sequence = change(place.servo.sequence)
