"""Values of the drive's objects that depend on the hardware, and checks and effects of SDO writes."""

import math
from collections.abc import Callable, Container
from fractions import Fraction
from typing import Protocol

from hil_sim.config import AxisPlant
from hil_sim.drive.axis_port import (
    POSITION_REVERSED,
    SCALE_SENSOR,
    TORQUE_REVERSED,
    VELOCITY_REVERSED,
    AxisPort,
)
from hil_sim.drive.brake_control import SET_BRAKE, BrakeControl
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.homing_methods import METHODS
from hil_sim.drive.motion import Motion
from hil_sim.drive.position_range import LINEAR, NEGATIVE, POSITIVE, SHORTEST
from hil_sim.drive.profile_modes import JERK_LIMITED, TO_DEMAND
from hil_sim.drive.touch_probe import FUNCTION_BITS
from hil_sim.node.dictionary import Dictionary
from hil_sim.node.sdo_abort import AbortCode, SdoAbort

EFFECTIVE_AT_ONCE = (0x6040, 0x6060, 0x6072, 0x6073, 0x60B8, 0x60E0, 0x60E1, 0x60FE)
"""Objects whose write by SDO takes effect at once, before the next tick."""
BUFFER_POSITION, BUFFER_CLEAR = 4, 6
"""Subindices of 60C4h."""
POSITIONING_OPTIONS = tuple(
    relative | rotary for relative in (0, TO_DEMAND, 2) for rotary in (LINEAR, NEGATIVE, POSITIVE, SHORTEST)
)
"""Supported values of 60F2h: what a relative set-point is relative to, and the direction of a rotary axis.

Bits 2 to 5 are 0: only bit 5 of the controlword selects whether a set-point acts at once, and only bit 4 is
the handshake.
"""
UINT16_MAX = 0xFFFF
POLARITY_BITS = POSITION_REVERSED | VELOCITY_REVERSED | TORQUE_REVERSED
"""Bits of 607Eh; the others are reserved."""


class DictionaryOwner(Protocol):
    """The interface of `Drive` that checks and followers of the dictionary call."""

    objects: DriveObjects
    port: AxisPort
    motion: Motion
    brake: BrakeControl

    def process(self) -> None:
        """Act on changed process objects."""

    def is_idle(self) -> bool:
        """Return whether the motor has no power."""

    last_set_point: int
    """The last buffered set point of interpolated position (counts), which 60C1h:01 shows."""

    def push_set_point(self, set_point: int) -> bool:
        """Buffer a set point; return whether there was room."""

    def clear_set_point(self) -> None:
        """Mark the set point in 60C1h:01 as used, so that the same value can be written again."""

    def apply_polarity(self) -> None:
        """Apply the polarity 607Eh."""

    def apply_position_range(self) -> None:
        """Apply the position range limit 607Bh."""

    def limit_speed(self) -> None:
        """Apply the max motor speed 6080h."""


def hardware_values(config: AxisPlant) -> dict[tuple[int, int], int]:
    """Return the values of the objects that describe motor, encoder, screw and amplifier, by address."""
    motor = config.motor
    peak_a = config.amplifier.peak_current_a
    peak_current = round(peak_a * 1e6 / motor.rated_current_ma)
    peak_torque = round(peak_a * motor.torque_constant_nm_a * 1e6 / motor.rated_torque_mnm)
    resolution = Fraction(0)
    if config.scale is not None:  # increments of the scale in a turn of the motor
        resolution = Fraction(
            config.transmission.lead_mm * 1e3 / config.scale.resolution_um
        ).limit_denominator(1000)
    scale = {(index, 1): resolution.numerator for index in (0x60E6, 0x60E7, 0x60E9)}
    scale |= {(index, 1): resolution.denominator for index in (0x60EB, 0x60EC, 0x60EE)}
    brake = config.brake
    times_ms = (0.0, 0.0) if brake is None else (brake.release_ms, brake.engage_ms)
    return scale | {
        (0x2011, 1): math.ceil(times_ms[0]),
        (0x2011, 2): math.ceil(times_ms[1]),
        (0x6072, 0): min(UINT16_MAX, peak_torque),
        (0x6073, 0): min(UINT16_MAX, peak_current),
        (0x6075, 0): motor.rated_current_ma,
        (0x6076, 0): motor.rated_torque_mnm,
        (0x6079, 0): round(config.amplifier.voltage_limit_v * 1e3),
        (0x608F, 1): config.encoder.counts_per_rev,
        (0x6090, 1): config.encoder.counts_per_rev,
        (0x6092, 1): config.encoder.counts_per_rev,
    }


Check = Callable[[int, int], None]


def only_in(allowed: Container[int]) -> Check:
    """Return a check that refuses all values but these."""

    def check(_subindex: int, value: int) -> None:
        if value not in allowed:
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)

    return check


def without(reserved: int) -> Check:
    """Return a check that refuses values with one of these bits."""

    def check(_subindex: int, value: int) -> None:
        if value & reserved:
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)

    return check


def connect_objects(dictionary: Dictionary, drive: DictionaryOwner) -> None:
    """Install the checks of SDO writes, and the actions of the drive on writes and reads."""

    def software_limits(subindex: int, value: int) -> None:
        objects = drive.objects
        low = value if subindex == 1 else objects.min_position_limit
        high = value if subindex == 2 else objects.max_position_limit
        if low > high:
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)

    dictionary.checks[0x6060] = only_in(drive.motion.modes)
    dictionary.checks[0x6098] = only_in((0, *METHODS))
    dictionary.checks[0x607D] = software_limits

    def position_range(subindex: int, value: int) -> None:
        objects = drive.objects
        low = value if subindex == 1 else objects.min_position_range_limit
        high = value if subindex == 2 else objects.max_position_range_limit
        if low >= high:
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
        if not drive.is_idle():
            raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)

    dictionary.checks[0x607B] = position_range
    dictionary.followers[0x607B] = lambda _sub: drive.apply_position_range()

    def polarity(_subindex: int, value: int) -> None:
        if value & ~POLARITY_BITS:
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
        if not drive.is_idle():
            raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)

    dictionary.checks[0x607E] = polarity
    dictionary.followers[0x607E] = lambda _sub: drive.apply_polarity()
    dictionary.followers[0x6080] = lambda _sub: drive.limit_speed()
    dictionary.checks[0x606A] = only_in((0, SCALE_SENSOR) if drive.port.has_scale else (0,))
    dictionary.checks[0x6086] = only_in((0, JERK_LIMITED))
    dictionary.checks[0x60F2] = only_in(POSITIONING_OPTIONS)
    dictionary.checks[0x60B8] = without(~FUNCTION_BITS)
    dictionary.checks[0x60FE] = without(~SET_BRAKE)
    dictionary.readers[0x60FE] = lambda sub: drive.brake.output_state() if sub == 1 else None
    connect_interpolation(dictionary, drive)
    for index in EFFECTIVE_AT_ONCE:
        dictionary.followers[index] = lambda _sub: drive.process()


def connect_interpolation(dictionary: Dictionary, drive: DictionaryOwner) -> None:
    """Buffer the set points written to 60C1h, and show and clear the buffer by 60C4h."""
    motion = drive.motion  # its mode is looked up at every access, because a reset creates new modes

    def buffered(_subindex: int, value: int) -> None:
        if not drive.push_set_point(value):
            raise SdoAbort(AbortCode.OUT_OF_MEMORY)

    def clear(subindex: int) -> None:
        if subindex == BUFFER_CLEAR:
            motion.interpolated.set_points.clear()

    dictionary.checks[0x60C1] = buffered
    dictionary.followers[0x60C1] = lambda _sub: drive.clear_set_point()
    dictionary.readers[0x60C1] = lambda sub: drive.last_set_point if sub else None
    dictionary.readers[0x60C4] = lambda sub: (
        len(motion.interpolated.set_points) if sub == BUFFER_POSITION else None
    )
    dictionary.followers[0x60C4] = clear
