"""A drive with the ways of another family: units, mode switching, statusword, patience.

What it does with its motor is that of `amplifier_device`. Velocities and accelerations are numbers of the
family's units for every client, by SDO and by PDO, and counts/s and counts/s^2 inside.
"""

import time
from typing import Any

from hil_sim.config import AxisPlant, Plant
from hil_sim.config.model import Personality
from hil_sim.drive import cia402_device as cia402
from hil_sim.drive.amplifier_device import Drive
from hil_sim.drive.cia402_device import State
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.node.process_objects import FractionalValue
from hil_sim.node.sdo_abort import AbortCode, SdoAbort
from hil_sim.node.slave import NodeHost

HOMING = 6
ENABLE_BIT = 0x08
TARGET_REACHED = 0x0400
HOMING_METHOD = 0x6098
VELOCITIES = (
    "velocity_demand_value",
    "velocity_actual_value",
    "velocity_window",
    "velocity_threshold",
    "max_profile_velocity",
    "profile_velocity",
    "speed_during_search_for_switch",
    "speed_during_search_for_zero",
    "velocity_offset",
    "target_velocity",
)
"""Attributes of `DriveObjects` in counts/s."""
ACCELERATIONS = (
    "profile_acceleration",
    "profile_deceleration",
    "quick_stop_deceleration",
    "homing_acceleration",
    "max_acceleration",
)
"""Those in counts/s^2."""
SHOWN = "shown_"
"""Begins the name of the attribute that clients see in another unit."""


class PersonalDrive(Drive):
    """The amplifier of an axis whose plant file gives it a personality. Raises what `Drive` raises."""

    def __init__(
        self, ways: Personality, config: AxisPlant, plant: Plant, index: int, host: NodeHost
    ) -> None:
        self._ways = ways
        super().__init__(config, plant, index, host, _scaled_objects(ways), ways.inside_eds)
        dictionary = self.slave.dictionary
        for address, name in dictionary.attributes.items():
            if hasattr(type(self.objects), SHOWN + name):
                dictionary.attributes[address] = SHOWN + name
        dictionary.load_defaults(0x2000, 0xFFFF)
        homing_methods = dictionary.checks[HOMING_METHOD]

        def homing_method(subindex: int, value: int) -> None:
            if not value and not self._ways.no_homing_method:
                raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
            homing_methods(subindex, value)

        dictionary.checks[HOMING_METHOD] = homing_method
        if self._ways.sdo_delay_ms:
            self.slave.sdo.on_request = self._late(self.slave.sdo.on_request)  # type: ignore[method-assign]

    def _late(self, serve: Any) -> Any:
        """Serve a frame after a while; the bench waits with it, as nobody shares the drive's SDO channel."""

        def on_request(frame: bytes) -> None:
            time.sleep(self._ways.sdo_delay_ms * 1e-3)
            serve(frame)

        return on_request

    def process(self) -> None:
        """Act on new objects; a mode that cannot be taken yet waits."""
        objects, ways = self.objects, self._ways
        wanted = objects.modes_of_operation
        enabled = self.state is State.OPERATION_ENABLED and not ways.mode_switch_enabled
        halted = bool(objects.controlword & cia402.HALT) and not ways.mode_switch_with_halt
        if enabled or halted:
            objects.modes_of_operation = objects.modes_of_operation_display
        super().process()
        objects.modes_of_operation = wanted

    def _execute(self, controlword: int, previous: int) -> None:
        if self._ways.needs_mode and not self.objects.modes_of_operation_display:
            controlword &= ~ENABLE_BIT
        super()._execute(controlword, previous)

    def _compose_statusword(self) -> None:
        super()._compose_statusword()
        homing = self.objects.modes_of_operation_display == HOMING
        if homing and not self._ways.homing_reached_bit and self.state is State.OPERATION_ENABLED:
            self.objects.statusword &= ~TARGET_REACHED


def _scaled_objects(ways: Personality) -> DriveObjects:
    """The objects of a drive, those of speed also as its clients see them."""
    units = dict.fromkeys(VELOCITIES, ways.velocity_counts_s)
    units |= dict.fromkeys(ACCELERATIONS, ways.acceleration_counts_s2)
    shown = {SHOWN + name: _scaled(name, unit) for name, unit in units.items()}
    inside = {name: FractionalValue(DriveObjects.VALUES[name].address) for name in units}
    scaled: type[DriveObjects] = type("ScaledObjects", (DriveObjects,), shown | inside)
    return scaled()


def _scaled(name: str, unit: float) -> property:
    """An attribute as clients see it."""

    def read(objects: DriveObjects) -> int:
        counts: float = getattr(objects, name)
        return round(counts / unit)

    def write(objects: DriveObjects, value: int) -> None:
        setattr(objects, name, value * unit)

    return property(read, write)
