"""Cams of CiA 406: eight position ranges, switched with hysteresis."""

from collections.abc import Callable

from hil_sim.node.dictionary import Dictionary

STATE, ENABLE, POLARITY = 0x6300, 0x6301, 0x6302
LOW, HIGH, HYSTERESIS = 0x6310, 0x6320, 0x6330
"""Objects of the first cam; the others follow."""
CAMS, CHANNEL = 8, 1


class Cams:
    """The cams of one channel; `on_change` is called after a client has written one of their objects."""

    def __init__(self, dictionary: Dictionary, on_change: Callable[[], None]) -> None:
        self._value = dictionary.value
        self._limits: list[tuple[int, int, int, int]] = []  # bit, low, high, hysteresis of the enabled cams
        self._polarity = 0
        self._inside = 0
        per_cam = (first + cam for first in (LOW, HIGH, HYSTERESIS) for cam in range(CAMS))
        for index in (ENABLE, POLARITY, *per_cam):
            dictionary.followers[index] = lambda _sub: on_change()

    def apply_objects(self) -> None:
        """Apply the objects; a cam that becomes enabled starts inactive."""
        value = self._value
        enabled = value(ENABLE, CHANNEL)
        self._polarity = value(POLARITY, CHANNEL) & enabled
        self._inside &= enabled
        self._limits = [
            (1 << cam, *(value(first + cam, CHANNEL) for first in (LOW, HIGH, HYSTERESIS)))
            for cam in range(CAMS)
            if enabled >> cam & 1
        ]

    @property
    def any_enabled(self) -> bool:
        """Whether any cam is enabled."""
        return bool(self._limits)

    def state(self, position: int) -> int:
        """Return the cam state register 6300h at a position: one bit a cam, inverted by its polarity."""
        for bit, low, high, hysteresis in self._limits:
            margin = hysteresis if self._inside & bit else 0
            if low - margin <= position <= high + margin:
                self._inside |= bit
            else:
                self._inside &= ~bit
        return self._inside ^ self._polarity
