"""Holding brake of an axis: springs close it, a coil opens it, each after a delay.

Law: a closed brake adds its force to the Coulomb level of the table (like a jam, see `faults/jammed_axis`),
so that it holds a standing axis and decelerates a moving one. It acts only at the ticks of the drive.
"""

from typing import Any


class HoldingBrake:
    """A brake of `force_n` at the table, 0 = none; it opens in `release_ms` and closes in `engage_ms`.

    `coulomb`: the `coulomb_friction` record of its axis, which it changes. `moving`: whether its armature
    moves, so that every tick must call `run`.
    """

    def __init__(self, coulomb: Any, force_n: float, release_ms: float, engage_ms: float) -> None:
        self._coulomb = coulomb
        self._without = int(coulomb["enabled"]), float(coulomb["coulomb_n"])
        self._force_n = force_n
        self._release_us, self._engage_us = 1000.0 * release_ms, 1000.0 * engage_ms
        self.moving = False
        self._closed = self._wanted = force_n > 0.0
        self._due_us = 0.0
        if self._closed:
            self._act()

    def drive(self, *, close: bool, now_us: int) -> None:
        """Switch the coil, off to close the brake, on to open it."""
        if close == self._wanted or not self._force_n:
            return
        self._wanted = close
        self.moving = close != self._closed
        self._due_us = now_us + (self._engage_us if close else self._release_us)
        self.run(now_us)

    def run(self, now_us: int) -> None:
        """Complete the motion of the armature after its delay."""
        if self.moving and now_us >= self._due_us:
            self.moving, self._closed = False, self._wanted
            self._act()

    def _act(self) -> None:
        enabled, coulomb_n = self._without
        self._coulomb["enabled"] = 1 if self._closed else enabled
        self._coulomb["coulomb_n"] = coulomb_n + self._force_n if self._closed else coulomb_n
