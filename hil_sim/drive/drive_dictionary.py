"""Objects of the drive that depend on the hardware, and writes that depend on the drive's state."""

from collections.abc import Container
from typing import Any, Protocol

from hil_sim.config import AxisPlant
from hil_sim.drive.axis_port import POSITION_REVERSED, TORQUE_REVERSED, VELOCITY_REVERSED, AxisPort
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.homing import METHODS
from hil_sim.drive.motion import Motion
from hil_sim.node.dictionary import Dictionary
from hil_sim.node.sdo_abort import AbortCode, SdoAbort

ACTED_ON_AT_ONCE = (0x6040, 0x6060, 0x6072, 0x6073)
LARGEST_U16 = 0xFFFF
POLARITY_BITS = POSITION_REVERSED | VELOCITY_REVERSED | TORQUE_REVERSED
"""Bits of 607Eh; the others are reserved."""


class GuardedDrive(Protocol):
    """The part of the drive that the dictionary uses."""

    objects: DriveObjects
    port: AxisPort
    motion: Motion

    def process(self) -> None:
        """Act on new process objects."""

    def is_idle(self) -> bool:
        """Whether the motor has no power."""


def hardware_values(config: AxisPlant) -> dict[tuple[int, int], int]:
    """Values of the objects that describe motor, encoder, screw and amplifier of the axis."""
    motor = config.motor
    peak_a = config.amplifier.peak_current_a
    peak_current = round(peak_a * 1e6 / motor.rated_current_ma)
    peak_torque = round(peak_a * motor.torque_constant_nm_a * 1e6 / motor.rated_torque_mnm)
    return {
        (0x6072, 0): min(LARGEST_U16, peak_torque),
        (0x6073, 0): min(LARGEST_U16, peak_current),
        (0x6075, 0): motor.rated_current_ma,
        (0x6076, 0): motor.rated_torque_mnm,
        (0x608F, 1): config.encoder.counts_per_rev,
        (0x6092, 1): config.encoder.counts_per_rev,
    }


def guard(dictionary: Dictionary, drive: GuardedDrive) -> None:
    """Refuse writes of invalid values, and have the drive act at once on those in ACTED_ON_AT_ONCE."""

    def only_in(allowed: Container[int]) -> Any:
        def check(_subindex: int, value: int) -> None:
            if value not in allowed:
                raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)

        return check

    def software_limits(subindex: int, value: int) -> None:
        objects = drive.objects
        low = value if subindex == 1 else objects.min_position_limit
        high = value if subindex == 2 else objects.max_position_limit
        if low > high:
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)

    dictionary.checks[0x6060] = only_in(drive.motion.modes)
    dictionary.checks[0x6098] = only_in((0, *METHODS))
    dictionary.checks[0x607D] = software_limits

    def polarity(_subindex: int, value: int) -> None:
        if value & ~POLARITY_BITS:
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
        if not drive.is_idle():
            raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)

    dictionary.checks[0x607E] = polarity
    dictionary.followers[0x607E] = lambda _sub: drive.port.set_polarity(drive.objects.polarity)
    for index in ACTED_ON_AT_ONCE:
        dictionary.followers[index] = lambda _sub: drive.process()
