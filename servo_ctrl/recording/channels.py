"""Declares the cyclic values once: the values of a row and so the columns of recording, page and MQTT stream.

A field of a row type is a channel with name, unit, meaning and type in the file. `places_of` gives the place
of a channel in a row by its name.
"""

from collections.abc import Iterable
from typing import Annotated, Any, NamedTuple, get_type_hints


class Channel(NamedTuple):
    """One column. `dtype` is the numpy type in the file."""

    unit: str
    meaning: str
    dtype: str = "float64"
    name: str = ""
    """Name of the declaring field; in `channels_of` preceded by the name of the axis."""


class MachineRow(NamedTuple):
    """The values that a row has once, before those of the axes."""

    time_s: Annotated[float, Channel("s", "time of the SYNC that latched the inputs, from the first SYNC")]
    cycle: Annotated[
        int, Channel("1", "SYNC periods since the first SYNC; missed ones are missing here too", "int64")
    ]
    segment: Annotated[
        int, Channel("1", "index into `segments` of recording.json; -1 outside the program", "int32")
    ]


class AxisRow(NamedTuple):
    """The values that a row has for every axis; the channel is `<axis>.<field>`."""

    position_command_m: Annotated[float, Channel("m", "set point; NaN while the drive leads the axis")]
    velocity_command_m_s: Annotated[float, Channel("m/s", "set point, from the motion profile")]
    motor_position_m: Annotated[float, Channel("m", "motor encoder times lead; NaN when missing")]
    scale_position_m: Annotated[float, Channel("m", "linear scale, zeroed on the motor at take-over")]
    motor_velocity_m_s: Annotated[float, Channel("m/s", "estimate that the velocity loop uses")]
    force_command_n: Annotated[float, Channel("N", "force at the table, limited (CST; else 0)")]
    motor_current_a: Annotated[float, Channel("A", "current_actual_value; NaN when not in the TPDO")]
    position_error_m: Annotated[float, Channel("m", "set point - feedback of the position loop")]
    pulse_m_s: Annotated[float, Channel("m/s", "friction compensation pulse in the velocity set point")]
    disturbance_n: Annotated[float, Channel("N", "what the disturbance observer added to the force")]
    correction_m: Annotated[float, Channel("m", "how far the motor is led beside the command")]
    statusword: Annotated[int, Channel("1", "statusword of the drive (6041h)", "uint16")]


def _channels(row: Any) -> tuple[Channel, ...]:
    hints = get_type_hints(row, include_extras=True)
    return tuple(hint.__metadata__[0]._replace(name=name) for name, hint in hints.items())


MACHINE_CHANNELS = _channels(MachineRow)
"""Columns that a recording has once."""
AXIS_CHANNELS = _channels(AxisRow)
"""Columns that a recording has for every axis, named `<axis>.<name>`."""


def channels_of(axes: Iterable[str]) -> tuple[Channel, ...]:
    """Return all columns of a recording of these axes, in row order."""
    per_axis = [channel._replace(name=f"{axis}.{channel.name}") for axis in axes for channel in AXIS_CHANNELS]
    return (*MACHINE_CHANNELS, *per_axis)


def places_of(axes: Iterable[str]) -> dict[str, int]:
    """Return the place of each channel in a row, by name."""
    return {channel.name: place for place, channel in enumerate(channels_of(axes))}
