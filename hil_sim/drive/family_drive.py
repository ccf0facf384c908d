"""A drive that behaves as a family of real drives: units, mode switching, statusword, SDO delay.

Its motion is that of `amplifier_device`. Clients write and read velocities and accelerations in the units of
the family, by SDO and by PDO; inside the drive they are counts/s and counts/s^2.
"""

import time
from typing import Any

from hil_sim.config import AxisPlant, Plant
from hil_sim.config.model import Personality
from hil_sim.drive import cia402_device as cia402
from hil_sim.drive.amplifier_device import Drive
from hil_sim.drive.cia402_device import State
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.node.node_host import NodeHost
from hil_sim.node.process_objects import FractionalValue
from hil_sim.node.sdo_abort import AbortCode, SdoAbort

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
"""Attributes of `DriveObjects` in counts/s^2."""
FAMILY_UNIT = "family_unit_"
"""Prefix of the attribute that converts a value to the unit of the family."""


class FamilyDrive(Drive):
    """The drive of an axis whose plant file has a section `personality`. Raises what `Drive` raises."""

    def __init__(
        self, personality: Personality, config: AxisPlant, plant: Plant, index: int, host: NodeHost
    ) -> None:
        self._personality = personality
        objects = _scaled_objects(personality)
        super().__init__(config, plant, index, host, objects=objects, inside_eds=personality.inside_eds)
        dictionary = self.slave.dictionary
        for address, name in dictionary.attributes.items():
            if hasattr(type(self.objects), FAMILY_UNIT + name):
                dictionary.attributes[address] = FAMILY_UNIT + name
        dictionary.load_defaults(0x2000, 0xFFFF)
        homing_methods = dictionary.checks[HOMING_METHOD]

        def homing_method(subindex: int, value: int) -> None:
            if not value and not self._personality.no_homing_method:
                raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
            homing_methods(subindex, value)

        dictionary.checks[HOMING_METHOD] = homing_method
        if self._personality.sdo_delay_ms:
            self.slave.sdo.on_request = self._delayed(self.slave.sdo.on_request)  # type: ignore[method-assign]

    def _delayed(self, serve: Any) -> Any:
        """Return a server of SDO requests that answers after `sdo_delay_ms`; the bench waits meanwhile."""

        def on_request(frame: bytes) -> None:
            time.sleep(self._personality.sdo_delay_ms * 1e-3)
            serve(frame)

        return on_request

    def process(self) -> None:
        """Act on changed process objects; defer a mode of operation that the state does not allow."""
        objects, personality = self.objects, self._personality
        selected = objects.modes_of_operation
        enabled = self.state is State.OPERATION_ENABLED and not personality.mode_switch_enabled
        halted = bool(objects.controlword & cia402.HALT) and not personality.mode_switch_with_halt
        if enabled or halted:
            objects.modes_of_operation = objects.modes_of_operation_display
        super().process()
        objects.modes_of_operation = selected

    def _execute(self, controlword: int, previous: int) -> None:
        if self._personality.needs_mode and not self.objects.modes_of_operation_display:
            controlword &= ~ENABLE_BIT
        super()._execute(controlword, previous)

    def _compose_statusword(self) -> None:
        super()._compose_statusword()
        homing = self.objects.modes_of_operation_display == HOMING
        if homing and not self._personality.homing_reached_bit and self.state is State.OPERATION_ENABLED:
            self.objects.statusword &= ~TARGET_REACHED


def _scaled_objects(personality: Personality) -> DriveObjects:
    """Return process objects with velocities and accelerations also in the units of the family."""
    units = dict.fromkeys(VELOCITIES, personality.velocity_counts_s)
    units |= dict.fromkeys(ACCELERATIONS, personality.acceleration_counts_s2)
    converted = {FAMILY_UNIT + name: _converted(name, unit) for name, unit in units.items()}
    fractional = {name: FractionalValue(DriveObjects.VALUES[name].address) for name in units}
    scaled: type[DriveObjects] = type("ScaledObjects", (DriveObjects,), converted | fractional)
    return scaled()


def _converted(name: str, unit: float) -> property:
    """Return a property that converts attribute `name` to multiples of `unit`."""

    def read(objects: DriveObjects) -> int:
        counts: float = getattr(objects, name)
        return round(counts / unit)

    def write(objects: DriveObjects, value: int) -> None:
        setattr(objects, name, value * unit)

    return property(read, write)
