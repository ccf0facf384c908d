"""Holding brake of an axis: closed by springs, opened by a coil, each after its time.

Law: closed, it adds its torque to the Coulomb level of the table (like a jam, see `faults/jammed_axis`), so
it holds a standing axis and slows a moving one down. It acts at the ticks of the drive, not in between.
"""

import math

from hil_sim.config import AxisPlant, Plant


class HoldingBrake:
    """The brake of axis `index`; `moving`: its armature is under way, so that `run` is due every tick."""

    def __init__(self, config: AxisPlant, plant: Plant, index: int) -> None:
        brake = config.brake
        self._coulomb = plant.params[index]["coulomb_friction"]
        self._without = int(self._coulomb["enabled"]), float(self._coulomb["coulomb_n"])
        self._force_n = 0.0 if brake is None else brake.torque_nm * 2.0 * math.pi / config.lead_m
        times_ms = (0.0, 0.0) if brake is None else (brake.release_ms, brake.engage_ms)
        self._release_us, self._engage_us = (1000.0 * time_ms for time_ms in times_ms)
        self.moving = False
        self._closed = self._wanted = brake is not None
        self._due_us = 0.0
        if brake is not None:
            self._act()

    def drive(self, *, close: bool, now_us: int) -> None:
        """Switch the coil: off closes the brake, on opens it."""
        if close == self._wanted or not self._force_n:
            return
        self._wanted = close
        self.moving = close != self._closed
        self._due_us = now_us + (self._engage_us if close else self._release_us)
        self.run(now_us)

    def run(self, now_us: int) -> None:
        """Let the armature arrive when its time is over."""
        if self.moving and now_us >= self._due_us:
            self.moving, self._closed = False, self._wanted
            self._act()

    def _act(self) -> None:
        enabled, coulomb_n = self._without
        self._coulomb["enabled"] = 1 if self._closed else enabled
        self._coulomb["coulomb_n"] = coulomb_n + self._force_n if self._closed else coulomb_n
