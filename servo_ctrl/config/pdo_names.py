"""The objects that a machine file must map, by name and by address."""

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
