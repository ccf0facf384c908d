"""Process objects of the CiA 406 linear scale. Units: counts of 6005h.1 nm; speed 0.01 mm/s times 6005h.2."""

from typing import ClassVar, Protocol

from hil_sim.node.process_objects import Address, ProcessObjects, cia

OUT_OF_RANGE, OVERFLOW, UNDERFLOW = 1, 2, 4
"""Bits of the area state register 6400h."""
POSITION_ERROR = 1
"""Bit of the alarms 6503h."""


class Head(Protocol):
    """The source of objects that are computed at every access."""

    def acceleration(self) -> int:
        """Return the mean acceleration since the last call (mm/s^2)."""


class ScaleObjects(ProcessObjects):
    """One attribute per object that a PDO may map or that affects the scale; the EDS has types and limits."""

    COMPUTED: ClassVar[dict[Address, str]] = {
        (0x6040, 1): "acceleration_value_channel_1",
        (0x6400, 1): "area_state_channel_1",
        (0x6503, 0): "alarms",
    }
    head: Head | None = None

    reference_mark_passages: int = cia(0x2001, 1)
    position_value_at_reference_mark: int = cia(0x2001, 2)
    operating_parameters: int = cia(0x6000)
    total_measuring_range_in_measuring_units: int = cia(0x6002)
    preset_value: int = cia(0x6003)
    position_value: int = cia(0x6004)
    preset_value_channel_1: int = cia(0x6010, 1)
    position_value_channel_1: int = cia(0x6020, 1)
    speed_value_channel_1: int = cia(0x6030, 1)
    cam_state_channel_1: int = cia(0x6300, 1)
    work_area_low_limit_channel_1: int = cia(0x6401, 1)
    work_area_high_limit_channel_1: int = cia(0x6402, 1)
    warnings: int = cia(0x6505)
    offset_value: int = cia(0x6509)

    @property
    def acceleration_value_channel_1(self) -> int:
        """Mean acceleration of the head since the last access (mm/s^2)."""
        return self.head.acceleration() if self.head is not None else 0

    @property
    def area_state_channel_1(self) -> int:
        """Whether the position is above or below the limits of the work area."""
        if self.position_value > self.work_area_high_limit_channel_1:
            return OUT_OF_RANGE | OVERFLOW
        if self.position_value < self.work_area_low_limit_channel_1:
            return OUT_OF_RANGE | UNDERFLOW
        return 0

    @property
    def alarms(self) -> int:
        """Position error: the position is outside the measuring range, on either side of zero."""
        beyond = abs(self.position_value) > self.total_measuring_range_in_measuring_units
        return POSITION_ERROR if beyond else 0
