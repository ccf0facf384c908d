"""controller.toml as types: what the controller is told about a machine.

Millimetres and micrometres live here and in the files only; `freeze` turns them into SI. Every
section is frozen and refuses keys it does not know. Checks that need more than one key are in
`MachineConfig` and `AxisConfig`, so that a machine that loads is a machine that makes sense.
"""

from __future__ import annotations

from pathlib import Path  # noqa: TC003  # pydantic resolves the annotation when the class is made
from typing import Annotated, Literal, Self

from pydantic import Field, Strict, StringConstraints, field_validator, model_validator

from servo_ctrl.config.compensation_model import (
    DisturbanceObserverConfig,
    FrictionCompensationConfig,
    LearningConfig,
    Monitoring,
)
from servo_ctrl.config.fuzzy_pd_model import FuzzyPdConfig  # noqa: TC001
from servo_ctrl.config.motor_leading_model import (  # noqa: TC001
    SampledDualLoopConfig,
    ScrewCompensationConfig,
)
from servo_ctrl.config.mqtt_model import MqttConfig  # noqa: TC001  # for the same reason
from servo_ctrl.config.node_model import Controller, Drive, Scale  # noqa: TC001
from servo_ctrl.config.pdo_names import SETPOINT_OF_MODE, is_mapped
from servo_ctrl.config.section import NonNegative, Number, Positive, Section

AxisName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*$")]
Mode = Literal["cst", "csv", "csp"]


class Machine(Section):
    """What the machine is called."""

    name: Annotated[str, StringConstraints(min_length=1, max_length=64)]
    """Appears in recordings."""


class Bus(Section):
    """Cyclic timing of the bus."""

    sync_period_us: Annotated[int, Strict(), Field(ge=100, le=100_000)]
    """Communication cycle period (1006h), microseconds."""
    input_timeout_ms: Annotated[float, Strict(), Field(gt=0.0, le=60_000.0)] = 2000.0
    """Bound of every wait for the cyclic inputs, wall clock, milliseconds."""
    missed_per_1000: Annotated[int, Strict(), Field(ge=0, le=1000)] = 300
    """How many of 1000 periods may go by without a SYNC, or without a node's inputs."""


class Transmission(Section):
    """From motor turns to table travel."""

    lead_mm: Positive
    """Table travel per motor revolution, millimetres."""


class Limits(Section):
    """What no program and no command may exceed."""

    position_mm: Annotated[list[Number], Field(min_length=2, max_length=2)]
    """Lowest and highest position command, millimetres."""
    velocity_mm_s: Positive
    """Bound of programs, and of the velocity set point, mm/s."""
    acceleration_mm_s2: Positive
    """Bound of programs, mm/s^2."""
    jerk_mm_s3: Positive
    """Of the commands as sampled: change of acceleration per SYNC period."""
    force_n: Positive
    """Bound of the force command at the table, newtons."""
    following_error_mm: Positive
    """Largest position error before the fault policy acts, millimetres."""
    scale_deviation_mm: Positive | None = None
    """How far scale and encoder may drift apart, millimetres; half of following_error_mm where not given."""
    saturation_ms: Positive = 500.0
    """How long force or current may be at their limit without a break, milliseconds."""
    runaway_ms: Positive = 5.0
    """How long an axis may gather speed against what pushes it, milliseconds."""

    @field_validator("position_mm")
    @classmethod
    def _ordered(cls, value: list[float]) -> list[float]:
        if value[0] >= value[1]:
            raise ValueError(f"the lower limit {value[0]:g} must be below the upper limit {value[1]:g}")
        return value


class Control(Section):
    """Gains of the cascade: P position, PI velocity, feedforward."""

    feedback: Literal["scale", "motor"] = "scale"
    """What the position loop is closed on; the velocity loop is always closed on the motor."""
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
    """Share of the velocity command added behind the position loop; 1 = all of it."""
    acceleration_feedforward_kg: NonNegative = 0.0
    """Mass whose inertia force is added for the commanded acceleration, kg."""
    velocity_window_samples: Annotated[int, Strict(), Field(ge=1, le=2)] = 1
    """Velocity is (q[k] - q[k-n]) / (n T)."""
    velocity_filter_ms: NonNegative = 0.0
    """Time constant of a first-order low pass on that velocity; 0 = none."""


class AxisConfig(Section):
    """One axis: its nodes, its mechanics, its limits and its loop."""

    mode: Mode
    """Which loops are closed here: cst position and velocity, csv position, csp none."""
    homing_method: Annotated[int, Strict(), Field(ge=-128, le=127)] = 0
    """CiA 402 homing method, 0 = none."""
    drive: Drive
    """Amplifier and motor encoder."""
    scale: Scale | None = None
    """Linear scale, where there is one."""
    transmission: Transmission
    """From turns to travel."""
    limits: Limits
    """What may not be exceeded."""
    control: Control
    """Gains."""
    friction_compensation: FrictionCompensationConfig | None = None
    """Learned pulse at the reversals."""
    disturbance_observer: DisturbanceObserverConfig | None = None
    """Observer of what the nominal model leaves out."""
    fuzzy_pd: FuzzyPdConfig | None = None
    """Fuzzy-PD position law."""
    screw_compensation: ScrewCompensationConfig | None = None
    """Learned table of the screw's errors, and backlash take-up."""
    sampled_dual_loop: SampledDualLoopConfig | None = None
    """The scale read at the end point."""

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.control.feedback == "scale" and self.scale is None:
            raise ValueError('control.feedback: "scale" needs a scale section')
        for key, mapping, wanted in (
            ("drive.rpdo1", self.drive.rpdo1, ("controlword", "0x6040:00")),
            ("drive.rpdo1", self.drive.rpdo1, SETPOINT_OF_MODE[self.mode]),
            ("drive.tpdo1", self.drive.tpdo1, ("statusword", "0x6041:00")),
            ("drive.tpdo1", self.drive.tpdo1, ("position_actual_value", "0x6064:00")),
        ):
            if not is_mapped(mapping, wanted):
                raise ValueError(f'{key}: "{wanted[0]}" is missing; mode {self.mode} needs it')
        self._complete_compensations()
        if self.scale is not None and not is_mapped(self.scale.tpdo1, ("position_value", "0x6004:00")):
            raise ValueError('scale.tpdo1: "position_value" is missing')
        return self

    def _complete_compensations(self) -> None:
        """What each compensation needs of the rest."""
        for key in ("friction_compensation", "fuzzy_pd"):
            if self.mode == "csp" and getattr(self, key) is not None:
                raise ValueError(f"{key}: mode csp has no velocity set point of ours")
        if self.disturbance_observer is not None:
            if self.mode != "cst":
                raise ValueError("disturbance_observer: only mode cst has a force set point")
            if not is_mapped(self.drive.tpdo1, ("current_actual_value", "0x6078:00")):
                raise ValueError(
                    'drive.tpdo1: "current_actual_value" is missing; the disturbance_observer needs it'
                )
        led_by_motor = self.mode == "csp" or self.control.feedback == "motor"
        for key in ("screw_compensation", "sampled_dual_loop"):
            if getattr(self, key) is not None and self.scale is None:
                raise ValueError(f"{key}: there is no scale section to read")
            if getattr(self, key) is not None and not led_by_motor:
                raise ValueError(f'{key}: needs mode csp, or control.feedback "motor"')
        if self.sampled_dual_loop is not None and self.scale is not None:
            _refuse_out_of_reach(self.sampled_dual_loop, self.scale)


def _refuse_out_of_reach(config: SampledDualLoopConfig, scale: Scale) -> None:
    half_um, tolerance_um, key = 0.5 * scale.resolution_um, config.tolerance_um, "sampled_dual_loop"
    if tolerance_um < half_um:
        raise ValueError(
            f"{key}.tolerance_um: {tolerance_um:g} is less than half a count of the scale ({half_um:g}); "
            "no correction could ever meet it"
        )
    if config.limit_um < tolerance_um:
        raise ValueError(
            f"{key}.limit_um: {config.limit_um:g} is less than tolerance_um {tolerance_um:g}; "
            "nothing could ever be corrected"
        )


class MachineConfig(Section):
    """A whole controller.toml; `source` is the file it came from."""

    source: Path
    machine: Machine
    bus: Bus
    controller: Controller
    axes: Annotated[dict[AxisName, AxisConfig], Field(alias="axis", min_length=1)]
    monitoring: Monitoring = Monitoring()
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

    @property
    def period_s(self) -> float:
        """The SYNC period in seconds."""
        return self.bus.sync_period_us * 1e-6
