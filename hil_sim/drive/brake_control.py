"""Holding brake control: the brake output, bit 0 of 60FEh, in sequence with the power stage.

    enable: power on, hold standstill, release the brake, operation enabled after the time 2011h:01 (ms)
    disable after a ramp: standstill, set the brake, power off after the time 2011h:02 (ms)
    power off at once (transition 9, option code 0): set the brake at the same time

If bit 0 of the mask 60FEh:02 is set, bit 0 of 60FEh:01 (1 = brake set) drives the output instead of this
sequence, with the same times. If not, 60FEh:01 reads the state of the output.
"""

import math
from collections.abc import Callable

from hil_sim.config import AxisPlant, Plant
from hil_sim.cyclic.drive_record import store_fields
from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.node.nmt import Clock
from hil_sim.plant.holding_brake import HoldingBrake

SET_BRAKE = 1
"""Bit 0 of 60FEh; the drive has no other output."""


def brake_of(config: AxisPlant, plant: Plant, index: int) -> HoldingBrake:
    """Return the brake of axis `index` of the plant, set; without force where the axis has none."""
    coulomb, brake = plant.params[index]["coulomb_friction"], config.brake
    if brake is None:
        return HoldingBrake(coulomb, 0.0, 0.0, 0.0)
    force_n = brake.torque_nm * 2.0 * math.pi / config.lead_m
    return HoldingBrake(coulomb, force_n, brake.release_ms, brake.engage_ms)


class BrakeControl:
    """The brake output of one drive; `commanded_set`: whether the sequence commands a set brake."""

    def __init__(self, objects: DriveObjects, port: AxisPort, brake: HoldingBrake, clock: Clock) -> None:
        self._objects, self._port = objects, port
        self._clock = clock
        self.brake = brake
        self.outputs = (0, 0)
        """The values of 60FEh:01 and 02 in effect."""
        self.commanded_set = True
        self._since_us = 0

    def reset(self) -> None:
        """Set the brake, as after power-up."""
        self.commanded_set = True
        self.drive_output()

    def command(self, *, close: bool) -> None:
        """Set or release the brake for the sequence with the power stage."""
        if close != self.commanded_set:
            self.commanded_set = close
            self._since_us = self._clock.now_us
            self.drive_output()

    def drive_output(self) -> None:
        """Drive the output: by 60FEh:01 if the mask selects it, else by the sequence."""
        objects = self._objects
        self.outputs = objects.physical_outputs, objects.bit_mask
        acted = dict(zip(("acted_physical_outputs", "acted_bit_mask"), self.outputs, strict=True))
        store_fields(self._port.record, **acted)
        by_object = objects.bit_mask & SET_BRAKE
        close = bool(objects.physical_outputs & SET_BRAKE) if by_object else self.commanded_set
        self.is_set = close
        self.brake.drive(close=close, now_us=self._clock.now_us)

    def output_state(self) -> int:
        """Return the value that clients read from 60FEh:01: the state of the output."""
        return SET_BRAKE if self.is_set else 0

    def release_then(self, then: Callable[[], None]) -> Callable[[], None]:
        """Release the brake; return a function for every tick, which calls `then` after the release time."""
        self.command(close=False)
        return lambda: then() if self.released() else None

    def set_then(self, then: Callable[[], None]) -> Callable[[], None]:
        """Return a function for every tick after a ramp: it sets the brake, then calls `then` once set."""

        def at_rest() -> None:
            self.command(close=True)
            if self._elapsed(self._objects.brake_set_time):
                then()

        return at_rest

    def released(self) -> bool:
        """Return whether the release time 2011h:01 is over."""
        return not self.commanded_set and self._elapsed(self._objects.brake_release_time)

    def _elapsed(self, time_ms: int) -> bool:
        return self._clock.now_us - self._since_us >= 1000 * time_ms
