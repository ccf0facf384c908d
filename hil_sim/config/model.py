"""Schema of plant.toml: one table per axis; units are in the names of the keys."""

import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

UNCONFIGURED_NODE_ID = 255
"""Node id of a device until LSS assigns one (CiA 305)."""
NodeId = Annotated[int, Field(ge=1, le=127)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Number = Annotated[float, Field(allow_inf_nan=False)]


class Section(BaseModel):
    """A TOML table: frozen, every key known."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)


class BusNode(Section):
    """A device's place on the bus. `eds` is relative to the plant file in TOML, absolute once loaded."""

    node_id: NodeId | Literal[255]
    """255: unconfigured, LSS assigns one."""
    eds: Path


class Personality(Section):
    """How the drive of an axis differs from the standard one: the behaviour of a family of real drives."""

    inside_eds: Path
    """Describes all objects of the drive. Clients can access only those that its own `eds` describes."""
    velocity_counts_s: Positive = 1.0
    """Unit of its velocity objects, counts/s."""
    acceleration_counts_s2: Positive = 1.0
    """Unit of its acceleration objects, counts/s^2."""
    needs_mode: bool = False
    """Whether it enables operation only after a mode of operation is selected."""
    mode_switch_enabled: bool = True
    """Whether it accepts another mode of operation in operation enabled."""
    mode_switch_with_halt: bool = True
    """Whether it accepts another mode of operation while the halt bit is set."""
    homing_reached_bit: bool = True
    """Whether statusword bit 10 (target reached) reports the end of homing, besides bit 12."""
    no_homing_method: bool = True
    """Whether homing method 6098h accepts 0, no homing."""
    sdo_delay_ms: NonNegative = 0.0
    """Delay of its SDO responses, in wall-clock time."""


class DriveNode(BusNode):
    """The amplifier's place on the bus, and how it differs from the standard drive."""

    personality: Personality | None = None


class Scale(BusNode):
    """The grating scale: its place on the bus, measuring step and reference mark."""

    resolution_um: Positive
    reference_mark_mm: Number = 0.0


class Encoder(Section):
    """The motor encoder; an index pulse is at `index_mm`, and at every lead from there."""

    counts_per_rev: Annotated[int, Field(ge=1, le=2**31 - 1)]
    index_mm: Number = 0.0


class LimitSwitches(Section):
    """Positions beyond which the switches are active."""

    negative_mm: Number
    positive_mm: Number

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.negative_mm >= self.positive_mm:
            raise ValueError("negative_mm must be below positive_mm")
        return self


class HomeSwitch(Section):
    """The home switch is active from one position to another."""

    from_mm: Number
    to_mm: Number

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.from_mm >= self.to_mm:
            raise ValueError("from_mm must be below to_mm")
        return self


class TouchProbeInputs(Section):
    """Positions beyond which an input of a touch probe is active; None: not connected."""

    first_mm: Number | None = None
    second_mm: Number | None = None


class Brake(Section):
    """A holding brake on the motor shaft: its torque, and the times to release and to set it."""

    torque_nm: Positive
    release_ms: NonNegative
    engage_ms: NonNegative


class TemperatureProbe(Section):
    """A thermometer at the guide, connected to the amplifier; `surroundings_degc` at power-up and later."""

    surroundings_degc: Annotated[float, Field(ge=-40.0, le=100.0)] = 20.0
    lag_s: Positive = 20.0
    noise_k: NonNegative = 0.03


class Motor(Section):
    """Rating plate of the motor; `inertia_kg_cm2` is that of rotor, coupling and screw."""

    rated_torque_mnm: Annotated[int, Field(ge=1, le=2**32 - 1)]
    rated_current_ma: Annotated[int, Field(ge=1, le=2**32 - 1)]
    torque_constant_nm_a: Positive
    inertia_kg_cm2: NonNegative = 0.0


class Transmission(Section):
    """The ball screw."""

    lead_mm: Positive


class Table(Section):
    """The moving mass and its position at power-up."""

    mass_kg: Positive
    start_mm: Number = 0.0


class AxisPlant(Section):
    """One axis. `amplifier` and `effects` hold `Params` tuples in SI, by section name."""

    drive: DriveNode
    motor: Motor
    transmission: Transmission
    table: Table
    encoder: Encoder
    scale: Scale | None = None
    limit_switches: LimitSwitches
    home_switch: HomeSwitch | None = None
    brake: Brake | None = None
    touch_probes: TouchProbeInputs = TouchProbeInputs()
    temperature_probe: TemperatureProbe | None = None
    amplifier: Any
    effects: dict[str, Any] = {}

    @property
    def lead_m(self) -> float:
        """Travel per turn (m)."""
        return self.transmission.lead_mm * 1e-3

    @property
    def force_constant_n_a(self) -> float:
        """Motor force per current (N/A)."""
        return self.motor.torque_constant_nm_a * 2.0 * math.pi / self.lead_m

    @property
    def motor_mass_kg(self) -> float:
        """Rotating inertia as a mass at the screw (kg)."""
        return self.motor.inertia_kg_cm2 * 1e-4 * (2.0 * math.pi / self.lead_m) ** 2


class PlantConfig(Section):
    """The whole plant; the order of the axes is the order of the file."""

    name: str
    substep_us: Annotated[float, Field(ge=1.0, le=50.0)] = 50.0
    drive_tick_ms: Annotated[int, Field(ge=1, le=100)] = 1
    """Period in which the drives evaluate set points, limits and windows; above 1 only for endurance runs."""
    axes: Annotated[dict[str, AxisPlant], Field(min_length=1)]

    @field_validator("substep_us")
    @classmethod
    def _divides_a_millisecond(cls, substep_us: float) -> float:
        """Check that communication cycles and ticks of the drives are whole numbers of substeps."""
        if 1000.0 % substep_us:
            raise ValueError("1000 us must be a whole number of substeps")
        return substep_us

    @model_validator(mode="after")
    def _distinct_nodes(self) -> Self:
        nodes = [axis.drive.node_id for axis in self.axes.values()]
        nodes += [axis.scale.node_id for axis in self.axes.values() if axis.scale]
        for node in nodes:
            if node != UNCONFIGURED_NODE_ID and nodes.count(node) > 1:
                raise ValueError(f"node id {node} is used twice")
        return self

    @property
    def dt_s(self) -> float:
        """Duration of a substep (s)."""
        return self.substep_us * 1e-6
