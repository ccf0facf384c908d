"""controller.toml as types: the nodes on the bus, ours and those of an axis, and what they must map."""

from pathlib import Path  # pydantic resolves the annotation when the class is made
from typing import Annotated

from pydantic import Field, Strict, StringConstraints, field_validator

from servo_ctrl.config.section import FileSection, Positive

Count = Annotated[int, Strict(), Field(ge=1, le=0xFFFFFFFF)]
NodeId = Annotated[int, Strict(), Field(ge=1, le=127)]
TransmissionType = Annotated[int, Strict()]
PdoName = Annotated[str, StringConstraints(pattern=r"^([a-z][a-z0-9_.]*|0x[0-9A-Fa-f]{4}:[0-9A-Fa-f]{2})$")]
PdoMapping = Annotated[list[PdoName], Field(min_length=1, max_length=8)]

SETPOINT_OF_MODE: dict[str, tuple[str, str]] = {
    "cst": ("target_torque", "0x6071:00"),
    "csv": ("target_velocity", "0x60FF:00"),
    "csp": ("target_position", "0x607A:00"),
}
"""The object that carries the set point in each cyclic mode: its name and its address."""
TORQUE_OFFSET = ("torque_offset", "0x60B2:00")
"""The object that carries a force beside the force set point."""
VELOCITY_OFFSET = ("velocity_offset", "0x60B1:00")
"""The object that carries a velocity beside the position set point."""


def is_mapped(mapping: list[str], names: tuple[str, str]) -> bool:
    """Whether a PDO carries an object, given by its name or its address."""
    wanted = {name.lower() for name in names}
    return any(entry.lower() in wanted for entry in mapping)


def _checked_transmission_type(value: int) -> int:
    if not (0 <= value <= 240 or value in {254, 255}):
        raise ValueError("transmission type must be 0-240, 254 or 255")
    return value


class Controller(FileSection):
    """The controller's own CANopen node."""

    node_id: NodeId = 127
    """Our own node id."""
    eds: Path
    """Our own EDS file, relative to this file."""
    heartbeat_ms: Annotated[int, Strict(), Field(ge=0, le=0xFFFF)] = 100
    """Producer heartbeat time (1017h), milliseconds; 0 = none."""


class Drive(FileSection):
    """The amplifier of an axis and the motor encoder inside it."""

    node_id: NodeId
    """Node id of the amplifier."""
    eds: Path
    """Its EDS file, relative to this file."""
    rpdo1: PdoMapping
    """What we send: EDS parameter names in lower case with underscores, or "0x6071:00"."""
    tpdo1: PdoMapping
    """What we receive."""
    rpdo_transmission_type: TransmissionType = 1
    """1 = acts at the next SYNC, 255 = acts at once; 0-240, 254 or 255."""
    tpdo_transmission_type: TransmissionType = 1
    """1 = sent at every SYNC; 0-240, 254 or 255."""
    limit_switch_syncs: Annotated[int, Strict(), Field(ge=0, le=240)] = 0
    """Every how many SYNCs the drive sends its limit switches (60FDh) in TPDO 2; 0 = they are not read."""
    counts_per_rev: Count
    """Position units (encoder counts) of one motor revolution, 608Fh."""
    rated_torque_mnm: Count
    """6076h, mNm: the unit of all torques is a thousandth of it."""
    rated_current_ma: Count
    """6075h, mA: the unit of all currents is a thousandth of it."""
    torque_constant_nm_a: Positive
    """Torque per current of the motor, Nm/A."""

    _types = field_validator("rpdo_transmission_type", "tpdo_transmission_type")(_checked_transmission_type)


class Scale(FileSection):
    """The linear grating scale of an axis."""

    node_id: NodeId
    """Node id of the scale."""
    eds: Path
    """Its EDS file, relative to this file."""
    tpdo1: PdoMapping
    """What we receive; position_value at least."""
    tpdo_transmission_type: TransmissionType = 1
    """1 = sent at every SYNC; 0-240, 254 or 255."""
    resolution_um: Positive
    """Length of one count, micrometres (6005h sub 1)."""

    _types = field_validator("tpdo_transmission_type")(_checked_transmission_type)
