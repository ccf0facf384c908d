"""The brake output, bit 0 of 60FEh, in its order with power: what a drive does for a holding brake.

    enable: power at standstill, brake released, 2011h:01 ms later operation enabled
    disable behind a ramp: standstill, brake set, 2011h:02 ms later power off
    power off at once (transition 9, option code 0): brake set at the same moment

Bit 0 of the mask 60FEh:02 takes the brake output from this order and gives it to bit 0 of 60FEh:01 (1 = set);
the times are kept all the same. Without it 60FEh:01 reads as the output is.
"""

import math
from collections.abc import Callable

from hil_sim.config import AxisPlant, Plant
from hil_sim.drive.axis_port import AxisPort, store_fields
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.node.nmt import Clock
from hil_sim.plant.holding_brake import HoldingBrake

SET_BRAKE = 1
"""Bit 0 of 60FEh; the drive has no other output."""


def brake_of(config: AxisPlant, plant: Plant, index: int) -> HoldingBrake:
    """The brake of axis `index` of the plant, closed."""
    coulomb, brake = plant.params[index]["coulomb_friction"], config.brake
    if brake is None:
        return HoldingBrake(coulomb, 0.0, 0.0, 0.0)
    force_n = brake.torque_nm * 2.0 * math.pi / config.lead_m
    return HoldingBrake(coulomb, force_n, brake.release_ms, brake.engage_ms)


class BrakeControl:
    """The output of one drive. `wanted_set`: what the order with power asks for."""

    def __init__(self, objects: DriveObjects, port: AxisPort, brake: HoldingBrake, clock: Clock) -> None:
        self._objects, self._port = objects, port
        self._clock = clock
        self.brake = brake
        self.outputs = (0, 0)
        """60FEh:01 and 02 that were followed last."""
        self.wanted_set = True
        self._since_us = 0

    def reset(self) -> None:
        """Power up: nobody holds the axis but the brake."""
        self.wanted_set = True
        self.follow()

    def order(self, *, close: bool) -> None:
        """Set or release the brake in the order with power."""
        if close != self.wanted_set:
            self.wanted_set = close
            self._since_us = self._clock.now_us
            self.follow()

    def follow(self) -> None:
        """Drive the output: by the mask from 60FEh:01, else as ordered."""
        objects = self._objects
        self.outputs = objects.physical_outputs, objects.bit_mask
        acted = dict(zip(("acted_physical_outputs", "acted_bit_mask"), self.outputs, strict=True))
        store_fields(self._port.record, **acted)
        by_hand = objects.bit_mask & SET_BRAKE
        close = bool(objects.physical_outputs & SET_BRAKE) if by_hand else self.wanted_set
        self.is_set = close
        self.brake.drive(close=close, now_us=self._clock.now_us)

    def shown(self) -> int:
        """60FEh:01 as it reads: the outputs as they are."""
        return SET_BRAKE if self.is_set else 0

    def release_then(self, then: Callable[[], None]) -> Callable[[], None]:
        """Release the brake; what is returned does `then` once the time for it is over."""
        self.order(close=False)
        return lambda: then() if self.released() else None

    def set_then(self, then: Callable[[], None]) -> Callable[[], None]:
        """What to do at the end of a ramp: set the brake, and do `then` once it is closed."""

        def at_rest() -> None:
            self.order(close=True)
            if self._elapsed(self._objects.brake_set_time):
                then()

        return at_rest

    def released(self) -> bool:
        """Whether the time to release the brake is over."""
        return not self.wanted_set and self._elapsed(self._objects.brake_release_time)

    def _elapsed(self, time_ms: int) -> bool:
        return self._clock.now_us - self._since_us >= 1000 * time_ms
