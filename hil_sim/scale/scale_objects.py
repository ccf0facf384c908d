"""Process objects of the CiA 406 linear scale. Units: counts of 6005h.1 nm; speed 0.01 mm/s times 6005h.2."""

from dataclasses import dataclass

from hil_sim.node.process_objects import ProcessObjects, cia


@dataclass(slots=True)
class ScaleObjects(ProcessObjects):
    """One attribute per object; the EDS has types, limits and defaults."""

    reference_mark_passages: int = cia(0x2001, 1)
    position_value_at_reference_mark: int = cia(0x2001, 2)
    operating_parameters: int = cia(0x6000)
    preset_value: int = cia(0x6003)
    position_value: int = cia(0x6004)
    preset_value_channel_1: int = cia(0x6010, 1)
    position_value_channel_1: int = cia(0x6020, 1)
    speed_value_channel_1: int = cia(0x6030, 1)
    alarms: int = cia(0x6503)
    warnings: int = cia(0x6505)
    offset_value: int = cia(0x6509)
