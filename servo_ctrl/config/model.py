"""The schema of controller.toml: everything that the controller knows about a machine.

Millimetres and micrometres occur only here and in the files; `kernel_params` converts them to SI. Every
section is immutable and refuses unknown keys. `MachineConfig` and `AxisConfig` check several keys together,
so that a loaded machine is consistent.
"""

from pathlib import Path  # pydantic resolves the annotation when it makes the class
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import Field, Strict, StringConstraints, field_validator, model_validator

from servo_ctrl.config.contour_model import ContourControl
from servo_ctrl.config.law_sections import MEANINGS, SECTION_TYPES, objections, period_objections
from servo_ctrl.config.learning_model import LearningConfig, MonitoringConfig
from servo_ctrl.config.mqtt_model import MqttConfig  # pydantic resolves this annotation too
from servo_ctrl.config.node_model import SETPOINT_OF_MODE, Controller, Drive, Scale, Temperature, is_mapped
from servo_ctrl.config.plant_model import MeasuredPlant
from servo_ctrl.config.section import FileSection, NonNegative, Number, Positive

AxisName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*$")]
Mode = Literal["cst", "csv", "csp"]
T = TypeVar("T")


class MachineSection(FileSection):
    """The name of the machine."""

    name: Annotated[str, StringConstraints(min_length=1, max_length=64)]
    """Name of the machine in recordings."""


CAN_FD_KEYS = frozenset({"fd", "data_bit_rate_kbit_s", "data_bitrate", "dbitrate"})
"""Keys that a user of CAN FD might write into the file."""


class Bus(FileSection):
    """Cyclic timing of the bus."""

    sync_period_us: Annotated[int, Strict(), Field(ge=100, le=100_000)]
    """Communication cycle period (1006h), microseconds."""
    bit_rate_kbit_s: Literal[1000, 800, 500, 250, 125, 50, 20, 10] = 1000
    """Bit rate of the bus (CiA 301), kbit/s; the bus load is a share of it."""
    input_timeout_ms: Annotated[float, Strict(), Field(gt=0.0, le=60_000.0)] = 2000.0
    """Bound of every wait for the cyclic inputs, wall clock, milliseconds."""
    missed_per_1000: Annotated[int, Strict(), Field(ge=0, le=1000)] = 300
    """Tolerated number of periods without a SYNC, or without a node's inputs, out of 1000."""

    @model_validator(mode="before")
    @classmethod
    def _classic_can(cls, section: Any) -> Any:
        for key in CAN_FD_KEYS & set(section if isinstance(section, dict) else ()):
            raise ValueError(
                f"{key}: CAN FD is not supported; CANopen (CiA 301) is classic CAN, leave it out"
            )
        return section


class Transmission(FileSection):
    """Transmission from motor turns to table travel."""

    lead_mm: Positive
    """Table travel per motor revolution, millimetres."""


class Limits(FileSection):
    """Limits of every program and command."""

    position_mm: Annotated[list[Number], Field(min_length=2, max_length=2)]
    """Lowest and highest position set point, millimetres."""
    velocity_mm_s: Positive
    """Velocity limit of programs and of the velocity set point, mm/s."""
    acceleration_mm_s2: Positive
    """Acceleration limit of programs, mm/s^2."""
    jerk_mm_s3: Positive
    """Jerk limit of the sampled set points, change of acceleration per SYNC period, mm/s^3."""
    force_n: Positive
    """Limit of the force command at the table, newtons."""
    following_error_mm: Positive
    """Largest position error before the fault policy acts, millimetres."""
    scale_deviation_mm: Positive | None = None
    """Largest deviation between scale and encoder, millimetres; half of following_error_mm if not given."""
    saturation_ms: Positive = 500.0
    """Longest continuous time with force or current at the limit, milliseconds."""
    runaway_ms: Positive = 5.0
    """Longest time that an axis may accelerate against its motor force, milliseconds."""

    @field_validator("position_mm")
    @classmethod
    def _ordered(cls, value: list[float]) -> list[float]:
        if value[0] >= value[1]:
            raise ValueError(f"the lower limit {value[0]:g} must be below the upper limit {value[1]:g}")
        return value


class Control(FileSection):
    """Gains of the cascade: P position, PI velocity, feedforward."""

    feedback: Literal["scale", "motor"] = "scale"
    """Feedback of the position loop; the velocity loop always uses the motor encoder."""
    kp_1_s: NonNegative
    """Position loop: velocity per position error, 1/s."""
    ki_1_s2: NonNegative = 0.0
    """Position loop: integral gain, 1/s^2; 0 = no integrator."""
    kd: NonNegative = 0.0
    """Position loop: velocity per change of the error, m/s per m/s."""
    derivative_filter_ms: NonNegative = 0.0
    """Time constant of a first-order low pass on that change; 0 = none."""
    kv_n_s_m: NonNegative
    """Velocity loop: force per velocity error, N s/m."""
    ki_n_m: NonNegative = 0.0
    """Velocity loop: integral gain, N/m; 0 = no integrator."""
    velocity_feedforward: NonNegative = 0.0
    """Share of the velocity command added to the output of the position loop; 1 = all of it."""
    acceleration_feedforward_kg: NonNegative = 0.0
    """Mass for the acceleration feedforward: its inertia force is added to the force command, kg."""
    velocity_window_samples: Annotated[int, Strict(), Field(ge=1, le=2)] = 1
    """Velocity is (q[k] - q[k-n]) / (n T)."""
    velocity_filter_ms: NonNegative = 0.0
    """Time constant of a first-order low pass on that velocity; 0 = none."""


class InputShaper(FileSection):
    """Input shaping of the axis's set points against an oscillating structure."""

    kind: Literal["zv", "zvd"] = "zv"
    """zv: two impulses, delay of half a cycle; zvd: three, a whole cycle, robust to a frequency error."""
    frequency_hz: Annotated[float, Strict(), Field(ge=0.5, le=1000.0)]
    """Natural frequency of the structure while the axis is held, hertz."""
    damping_ratio: Annotated[float, Strict(), Field(ge=0.0, le=0.7)] = 0.0
    """Damping ratio of the oscillation."""


class AxisConfig(FileSection):
    """One axis: its nodes, its mechanics, its limits and its loop."""

    mode: Mode
    """Cyclic mode; the controller closes these loops: cst position and velocity, csv position, csp none."""
    homing_method: Annotated[int, Strict(), Field(ge=-128, le=127)] = 0
    """CiA 402 homing method, 0 = none."""
    drive: Drive
    """Amplifier and motor encoder."""
    scale: Scale | None = None
    """Linear scale, if there is one."""
    transmission: Transmission
    """Transmission from motor turns to table travel."""
    limits: Limits
    """Limits of motion, force and errors."""
    control: Control
    """Gains of the control law."""
    temperature: Temperature | None = None
    """Temperature of the guide, over which friction is scheduled."""
    input_shaper: InputShaper | None = None
    """Input shaping against an oscillating structure."""
    measured_plant: MeasuredPlant | None = None
    """Measured response of the axis, for margins."""
    # The sections of the control law by name; each part of the law declares its section.
    __annotations__.update({name: kind | None for name, kind in SECTION_TYPES.items()})
    vars().update({name: Field(None, description=MEANINGS[name]) for name in SECTION_TYPES})

    def section(self, kind: type[T]) -> T | None:
        """Return the settings of a part of the control law; None if the file lacks its section."""
        sections = (getattr(self, name) for name in SECTION_TYPES)
        return next((settings for settings in sections if isinstance(settings, kind)), None)

    def acts(self, kind: type[Any]) -> bool:
        """Whether a part of the control law has a section that enables it."""
        settings = self.section(kind)
        return settings is not None and bool(settings.enabled)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.control.feedback == "scale" and self.scale is None:
            raise ValueError('control.feedback: "scale" needs a scale section')
        for key, mapping, wanted in (
            ("drive.rpdo1", self.drive.sent, ("controlword", "0x6040:00")),
            ("drive.rpdo1", self.drive.sent, SETPOINT_OF_MODE[self.mode]),
            ("drive.tpdo1", self.drive.received, ("statusword", "0x6041:00")),
            ("drive.tpdo1", self.drive.received_every_cycle, ("position_actual_value", "0x6064:00")),
        ):
            if not is_mapped(mapping, wanted):
                raise ValueError(f'{key}: "{wanted[0]}" is missing; mode {self.mode} needs it')
        for objection in objections(self):
            raise ValueError(objection)
        if self.scale is not None and not is_mapped(self.scale.tpdo1, ("position_value", "0x6004:00")):
            raise ValueError('scale.tpdo1: "position_value" is missing')
        return self


class MachineConfig(FileSection):
    """A whole controller.toml; `source` is its path."""

    source: Path
    source_sha256: str = ""
    """SHA-256 of the file as it was read; "" of a machine that was not read from a file."""
    machine: MachineSection
    bus: Bus
    controller: Controller
    axes: Annotated[dict[AxisName, AxisConfig], Field(alias="axis", min_length=1)]
    contour_control: ContourControl | None = None
    monitoring: MonitoringConfig = MonitoringConfig()
    learning: LearningConfig = LearningConfig()
    mqtt: MqttConfig | None = None

    @model_validator(mode="after")
    def _node_ids_are_unique(self) -> Self:
        owners: dict[int, str] = {self.controller.node_id: "controller.node_id"}
        for name, axis in self.axes.items():
            sections = {"drive": axis.drive, "scale": axis.scale}
            for section, node in sections.items():
                if node is None:
                    continue
                key = f"axis.{name}.{section}.node_id"
                if node.node_id in owners:
                    raise ValueError(
                        f"{key}: node id {node.node_id} is already taken by {owners[node.node_id]}"
                    )
                owners[node.node_id] = key
        return self

    @model_validator(mode="after")
    def _temperatures_have_nodes(self) -> Self:
        nodes = {
            node.node_id
            for axis in self.axes.values()
            for node in (axis.drive, axis.scale)
            if node is not None
        }
        for name, axis in self.axes.items():
            source = axis.temperature
            if source is not None and source.node_id not in nodes:
                reason = f"node {source.node_id} is no drive or scale of this machine"
                raise ValueError(f"axis.{name}.temperature.node_id: {reason}")
        return self

    @model_validator(mode="after")
    def _period_suits_the_laws(self) -> Self:
        for name, axis in self.axes.items():
            for objection in period_objections(axis, self.period_s):
                raise ValueError(f"axis.{name}.{objection}")
        return self

    @property
    def period_s(self) -> float:
        """The SYNC period in seconds."""
        return self.bus.sync_period_us * 1e-6
