"""The columns of a recording: name, unit, type and meaning, in the order in which a row is filled."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable


class Channel(NamedTuple):
    """One column. `dtype` is a numpy type name; integers are kept as such in the file."""

    name: str
    unit: str
    dtype: str
    meaning: str


MACHINE_CHANNELS: tuple[Channel, ...] = (
    Channel("time_s", "s", "float64", "time of the SYNC that latched the inputs, from the first SYNC"),
    Channel("cycle", "1", "int64", "SYNC periods since the first SYNC; missed ones are missing here too"),
    Channel("segment", "1", "int32", "index into `segments` of recording.json; -1 outside the program"),
)
"""Columns that a recording has once."""

AXIS_CHANNELS: tuple[Channel, ...] = (
    Channel("position_command_m", "m", "float64", "set point; NaN while the drive leads the axis"),
    Channel("velocity_command_m_s", "m/s", "float64", "set point, from the motion profile"),
    Channel("motor_position_m", "m", "float64", "motor encoder times lead; NaN when missing"),
    Channel("scale_position_m", "m", "float64", "linear scale, zeroed on the motor at take-over"),
    Channel("motor_velocity_m_s", "m/s", "float64", "estimate that the velocity loop uses"),
    Channel("force_command_n", "N", "float64", "force at the table, limited (CST; else 0)"),
    Channel("motor_current_a", "A", "float64", "current_actual_value; NaN when not in the TPDO"),
    Channel("position_error_m", "m", "float64", "set point - feedback of the position loop"),
    Channel("pulse_m_s", "m/s", "float64", "friction compensation pulse in the velocity set point"),
    Channel("disturbance_n", "N", "float64", "what the disturbance observer added to the force"),
    Channel("correction_m", "m", "float64", "how far the motor is led beside the command"),
    Channel("statusword", "1", "uint16", "statusword of the drive (6041h)"),
)
"""Columns that a recording has for every axis, named `<axis>.<name>`."""


def channels_of(axes: Iterable[str]) -> tuple[Channel, ...]:
    """All columns of a recording of these axes, in row order."""
    per_axis = [channel._replace(name=f"{axis}.{channel.name}") for axis in axes for channel in AXIS_CHANNELS]
    return (*MACHINE_CHANNELS, *per_axis)
