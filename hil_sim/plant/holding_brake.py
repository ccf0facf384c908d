"""Holding brake of an axis: springs set it, a coil releases it, each after a delay.

Law: a set brake adds its force to the Coulomb level of the table (as does `faults/jammed_axis`), so that it
holds an axis at standstill and decelerates a moving one. It changes only at the ticks of the drive.
"""

from typing import Any


class HoldingBrake:
    """A brake of `force_n` at the table, 0 = none; it releases in `release_ms` and sets in `engage_ms`.

    `coulomb`: the `coulomb_friction` record of its axis, which it changes. `moving`: whether its armature
    moves, so that every tick must call `run`.
    """

    def __init__(self, coulomb: Any, force_n: float, release_ms: float, engage_ms: float) -> None:
        self._coulomb = coulomb
        self._without_brake = int(coulomb["enabled"]), float(coulomb["coulomb_n"])
        self._force_n = force_n
        self._release_us, self._engage_us = 1000.0 * release_ms, 1000.0 * engage_ms
        self.moving = False
        self._is_set = self._commanded_set = force_n > 0.0
        self._due_us = 0.0
        if self._is_set:
            self._apply()

    def drive(self, *, close: bool, now_us: int) -> None:
        """Switch the coil: off to set the brake, on to release it."""
        if close == self._commanded_set or not self._force_n:
            return
        self._commanded_set = close
        self.moving = close != self._is_set
        self._due_us = now_us + (self._engage_us if close else self._release_us)
        self.run(now_us)

    def run(self, now_us: int) -> None:
        """Complete the motion of the armature after its delay."""
        if self.moving and now_us >= self._due_us:
            self.moving, self._is_set = False, self._commanded_set
            self._apply()

    def _apply(self) -> None:
        """Write the level with or without the brake's force to the record of the axis."""
        enabled, coulomb_n = self._without_brake
        self._coulomb["enabled"] = 1 if self._is_set else enabled
        self._coulomb["coulomb_n"] = coulomb_n + self._force_n if self._is_set else coulomb_n
