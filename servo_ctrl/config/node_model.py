"""The schema of controller.toml: the controller's node, the nodes of an axis, and their PDO mappings."""

from pathlib import Path  # pydantic resolves the annotation when the class is made
from typing import Annotated, Literal, Self

from pydantic import Field, Strict, StringConstraints, field_validator, model_validator

from servo_ctrl.config.drive_units import unit_validator
from servo_ctrl.config.section import FileSection, Number, Positive

Count = Annotated[int, Strict(), Field(ge=1, le=0xFFFFFFFF)]
NodeId = Annotated[int, Strict(), Field(ge=1, le=127)]
TransmissionType = Annotated[int, Strict()]
PdoName = Annotated[str, StringConstraints(pattern=r"^([a-z][a-z0-9_.]*|0x[0-9A-Fa-f]{4}:[0-9A-Fa-f]{2})$")]
PdoMapping = Annotated[list[PdoName], Field(min_length=1, max_length=8)]
PdoKey = Annotated[str, StringConstraints(pattern=r"^[rt]pdo([1-9]|[1-9][0-9]|[1-4][0-9][0-9])$")]
ObjectAddress = Annotated[str, StringConstraints(pattern=r"^0x[0-9A-Fa-f]{4}$")]

SETPOINT_OF_MODE: dict[str, tuple[str, str]] = {
    "cst": ("target_torque", "0x6071:00"),
    "csv": ("target_velocity", "0x60FF:00"),
    "csp": ("target_position", "0x607A:00"),
}
"""Name and address of the set-point object in each cyclic mode."""
TORQUE_OFFSET = ("torque_offset", "0x60B2:00")
"""The object with a force added to the force set point."""
VELOCITY_OFFSET = ("velocity_offset", "0x60B1:00")
"""The object with a velocity added to the position set point."""


def is_mapped(mapping: list[str], names: tuple[str, str]) -> bool:
    """Whether a PDO maps an object, given by its name or its address."""
    wanted = {name.lower() for name in names}
    return any(entry.lower() in wanted for entry in mapping)


def _checked_transmission_type(value: int) -> int:
    if not (0 <= value <= 240 or value in {254, 255}):
        raise ValueError("transmission type must be 0-240, 254 or 255")
    return value


class Controller(FileSection):
    """The controller's own CANopen node."""

    node_id: NodeId = 127
    """Node id of the controller."""
    eds: Path
    """EDS file of the controller, relative to this file."""
    heartbeat_ms: Annotated[int, Strict(), Field(ge=0, le=0xFFFF)] = 100
    """Producer heartbeat time (1017h), milliseconds; 0 = none."""


class Pdo(FileSection):
    """Settings of a PDO: objects and type from PDO 2 on, identifier of any PDO."""

    objects: PdoMapping | None = None
    """Mapped objects, from PDO 2 on; rpdo1 and tpdo1 hold those of PDO 1."""
    cob_id: Annotated[int, Strict(), Field(ge=0x001, le=0x7FF)] | None = None
    """COB-ID; if not given that of the pre-defined connection set, which ends at PDO 4."""
    transmission_type: TransmissionType | None = None
    """From PDO 2 on: 1 (default) = every SYNC, n up to 240 = every n-th SYNC, 254, 255 = at a change."""
    event_timer_ms: Annotated[int, Strict(), Field(ge=0, le=0xFFFF)] = 0
    """TPDOs of type 254 and 255: event timer, sent after this time without a change, ms; 0 = none."""
    inhibit_ms: Annotated[float, Strict(), Field(ge=0.0, le=6553.5)] = 0.0
    """TPDOs of type 254 and 255: inhibit time, the shortest time between two of them, milliseconds."""

    @field_validator("transmission_type")
    @classmethod
    def _type(cls, value: int | None) -> int | None:
        return value if value is None else _checked_transmission_type(value)


class Node(FileSection):
    """Settings of every node on the bus."""

    node_id: NodeId
    """Node id on the bus."""
    eds: Path
    """Its EDS file, relative to this file."""
    concise_dcf: Path | None = None
    """Concise DCF (CiA 302, as made by dcfgen), written at boot before the settings of this file."""
    sdo_timeout_ms: Annotated[float, Strict(), Field(gt=0.0, le=60_000.0)] | None = None
    """Longest wait for an SDO response, milliseconds; if not given 300, in lockstep 1000."""
    leave_alone: Annotated[list[ObjectAddress], Field(min_length=0, max_length=64)] = []  # noqa: RUF012  # pydantic copies it
    """Objects in the EDS that the boot must neither read nor write, such as "0x6092"."""
    pdo: dict[PdoKey, Pdo] = {}  # noqa: RUF012  # pydantic copies it
    """PDOs by name."""

    def numbered(self, direction: str) -> dict[int, Pdo]:
        """Return the PDOs of one direction, "r" or "t", by number."""
        pdos = {int(key[4:]): pdo for key, pdo in self.pdo.items() if key[0] == direction}
        return dict(sorted(pdos.items()))

    @model_validator(mode="after")
    def _further_pdos_have_objects(self) -> Self:
        for key, pdo in self.pdo.items():
            if key[4:] == "1":
                if pdo.objects is not None or pdo.transmission_type is not None:
                    raise ValueError(
                        f"pdo.{key}: objects and type of PDO 1 are {key} and {key[:4]}_transmission_type"
                    )
            elif pdo.objects is None:
                raise ValueError(f"pdo.{key}.objects: is missing")
            if key[0] == "r" and (pdo.event_timer_ms or pdo.inhibit_ms):
                raise ValueError(
                    f"pdo.{key}: only what the node sends has an event timer and an inhibit time"
                )
        return self


class Drive(Node):
    """The amplifier of an axis and the motor encoder inside it."""

    rpdo1: PdoMapping
    """Objects sent to the drive: EDS parameter names in lower case with underscores, or "0x6071:00"."""
    tpdo1: PdoMapping
    """Objects received from the drive."""
    rpdo_transmission_type: TransmissionType = 1
    """1 = acts at the next SYNC, 255 = acts at once; 0-240, 254 or 255."""
    tpdo_transmission_type: TransmissionType = 1
    """1 = sent at every SYNC; 0-240, 254 or 255."""
    limit_switch_syncs: Annotated[int, Strict(), Field(ge=0, le=240)] = 0
    """Period in SYNCs at which the drive sends its limit switches (60FDh) in TPDO 2; 0 = not read."""
    counts_per_rev: Count
    """Position units (usually encoder counts) per motor revolution: 608Fh, or 6091h, 6092h and 60A8h."""
    velocity_unit: Annotated[str, Strict()] = "counts/s"
    """Unit of its velocities (60A9h): "counts/s", "rpm" or "rev/s", or a multiple such as "0.1 counts/s"."""
    acceleration_unit: Annotated[str, Strict()] = "counts/s2"
    """Unit of its accelerations (60AAh): "counts/s2", "rpm/s", "rev/s2", or a multiple: "10 counts/s2"."""
    homing_bits: Literal["10 and 12", "12"] = "10 and 12"
    """Statusword bits that mark the end of homing: some drives never set bit 10 (target reached) then."""
    mode_switch: Literal["enabled", "disabled"] = "enabled"
    """Where the drive accepts the mode change after homing: in operation enabled, or only without power."""
    rated_torque_mnm: Count
    """Rated torque (6076h), mNm; all torques are in thousandths of it."""
    rated_current_ma: Count
    """Rated current (6075h), mA; all currents are in thousandths of it."""
    torque_constant_nm_a: Positive
    """Torque per current of the motor, Nm/A."""

    _types = field_validator("rpdo_transmission_type", "tpdo_transmission_type")(_checked_transmission_type)
    _velocity = field_validator("velocity_unit")(unit_validator("/s"))
    _acceleration = field_validator("acceleration_unit")(unit_validator("/s2"))

    @property
    def sent(self) -> list[str]:
        """Objects of all RPDOs."""
        return self.rpdo1 + [name for pdo in self.numbered("r").values() for name in pdo.objects or ()]

    @property
    def received(self) -> list[str]:
        """Objects of all TPDOs."""
        return self.tpdo1 + [name for pdo in self.numbered("t").values() for name in pdo.objects or ()]

    @property
    def received_every_cycle(self) -> list[str]:
        """Objects of the TPDOs sent after every SYNC."""
        further = [pdo for pdo in self.numbered("t").values() if pdo.transmission_type in {None, 1}]
        return self.tpdo1 + [name for pdo in further for name in pdo.objects or ()]


class Temperature(FileSection):
    """An object with the temperature of the axis's guide, of the manufacturer: CiA 402 has none."""

    node_id: NodeId
    """Node that has it: a drive or scale of this machine."""
    address: Annotated[str, StringConstraints(pattern=r"^0x[0-9A-Fa-f]{4}:[0-9A-Fa-f]{2}$")]
    """Its index and subindex, such as "0x2012:00"; read by SDO once a second."""
    k_per_count: Positive
    """Kelvin of one count."""
    offset_degc: Number = 0.0
    """Temperature at 0 counts, degrees Celsius."""

    @property
    def index(self) -> int:
        """Index of the object."""
        return int(self.address[2:6], 16)

    @property
    def subindex(self) -> int:
        """Subindex of the object."""
        return int(self.address[7:], 16)


class Scale(Node):
    """The linear grating scale of an axis."""

    tpdo1: PdoMapping
    """Objects received from the scale, at least position_value."""
    tpdo_transmission_type: TransmissionType = 1
    """1 = sent at every SYNC; 0-240, 254 or 255."""
    resolution_um: Positive
    """Length of one count, micrometres (6005h sub 1)."""

    _types = field_validator("tpdo_transmission_type")(_checked_transmission_type)
