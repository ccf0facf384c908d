"""Schema of plant.toml: one table per axis, lengths in millimetres and micrometres."""

import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

UNNAMED = 255
"""The node id of a device that has none."""
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
    """255: none, LSS gives it one."""
    eds: Path


class Personality(Section):
    """How the drive of an axis differs from the bench's own: the ways of a family of real drives."""

    inside_eds: Path
    """What it has inside; its own EDS is what it shows, and what that leaves out no client finds."""
    velocity_counts_s: Positive = 1.0
    """One unit of its velocities, counts/s."""
    acceleration_counts_s2: Positive = 1.0
    """One unit of its accelerations, counts/s^2."""
    needs_mode: bool = False
    """Whether it enables operation only with a mode of operation."""
    mode_switch_enabled: bool = True
    """Whether it takes another mode in operation enabled."""
    mode_switch_with_halt: bool = True
    """Whether it takes another mode while the halt bit is set."""
    homing_reached_bit: bool = True
    """Whether statusword bit 10 (target reached) reports the end of homing, beside bit 12."""
    no_homing_method: bool = True
    """Whether 6098h takes 0."""
    sdo_delay_ms: NonNegative = 0.0
    """How long it takes over an SDO answer, wall clock."""


class DriveNode(BusNode):
    """The amplifier's place on the bus, and its ways."""

    personality: Personality | None = None


class Scale(BusNode):
    """The grating scale: its place on the bus, its step and its reference mark."""

    resolution_um: Positive
    reference_mark_mm: Number = 0.0


class Encoder(Section):
    """The motor encoder; an index pulse lies at `index_mm` and every lead from there."""

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
    """Positions beyond which an input of a touch probe is active; none: it is not connected."""

    first_mm: Number | None = None
    second_mm: Number | None = None


class Brake(Section):
    """A holding brake on the motor shaft: its torque, and how long it takes to open and to close."""

    torque_nm: Positive
    release_ms: NonNegative
    engage_ms: NonNegative


class Motor(Section):
    """Rating plate of the motor; `inertia_kg_cm2` is rotor, coupling and screw."""

    rated_torque_mnm: Annotated[int, Field(ge=1, le=2**32 - 1)]
    rated_current_ma: Annotated[int, Field(ge=1, le=2**32 - 1)]
    torque_constant_nm_a: Positive
    inertia_kg_cm2: NonNegative = 0.0


class Transmission(Section):
    """The ball screw."""

    lead_mm: Positive


class Table(Section):
    """The moving mass and where it stands at power-up."""

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
        """Rotating inertia as a mass at the screw."""
        return self.motor.inertia_kg_cm2 * 1e-4 * (2.0 * math.pi / self.lead_m) ** 2


class PlantConfig(Section):
    """The whole plant; the order of the axes is the order of the file."""

    name: str
    substep_us: Annotated[float, Field(ge=1.0, le=50.0)] = 50.0
    drive_tick_ms: Annotated[int, Field(ge=1, le=100)] = 1
    """How often the drives look at set points, limits and windows; more than 1 is for long soaks."""
    axes: Annotated[dict[str, AxisPlant], Field(min_length=1)]

    @field_validator("substep_us")
    @classmethod
    def _divides_a_millisecond(cls, substep_us: float) -> float:
        """Communication cycles and the ticks of the drives are whole substeps."""
        if 1000.0 % substep_us:
            raise ValueError("1000 us must be a whole number of substeps")
        return substep_us

    @model_validator(mode="after")
    def _distinct_nodes(self) -> Self:
        nodes = [axis.drive.node_id for axis in self.axes.values()]
        nodes += [axis.scale.node_id for axis in self.axes.values() if axis.scale]
        for node in nodes:
            if node != UNNAMED and nodes.count(node) > 1:
                raise ValueError(f"node id {node} is used twice")
        return self

    @property
    def dt_s(self) -> float:
        """Substep (s)."""
        return self.substep_us * 1e-6
