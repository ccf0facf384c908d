"""Settings that boot writes into the nodes besides the PDOs: values of the machine file in device units."""

import math
from collections.abc import Iterator

from servo_ctrl.canopen.scaling import drive_scaling
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.control.compensation.sampled_dual_loop import SampledDualLoopSettings
from servo_ctrl.control.compensation.screw_error import ScrewCompensationSettings
from servo_ctrl.cyclic.cia402 import MODE_OF_NAME
from servo_ctrl.errors import ConfigError

HEARTBEATS_MISSED = 3
"""Consumer heartbeat time as a multiple of the producer heartbeat time, in the nodes and here; chosen."""
HOMING_SPEED_SHARE = (0.1, 0.01)
"""6099h: speeds towards the switch and towards the index as shares of the velocity limit; chosen."""
QUICK_STOP_RAMP_THEN_DISABLE = 2
"""605Ah: brake along the quick stop ramp, then switch on disabled (CiA 402)."""
ABORT_CONNECTION_QUICK_STOP = 3
"""6007h: a lost connection has the effect of the quick stop command (CiA 402)."""
Setting = tuple[int, int, int, str]
"""(index, subindex, value, name in messages)."""


def common_settings(machine: MachineConfig) -> Iterator[Setting]:
    """Yield the settings of every node: SYNC period, producer and consumer heartbeat time."""
    controller = machine.controller
    yield (0x1006, 0, machine.bus.sync_period_us, "communication cycle period")
    yield (0x1017, 0, controller.heartbeat_ms, "producer heartbeat time")
    consumed = min(controller.heartbeat_ms * HEARTBEATS_MISSED, 0xFFFF)
    yield (0x1016, 1, controller.node_id << 16 | consumed, "consumer heartbeat time")


def force_limit_permille(axis: AxisConfig) -> tuple[int, int]:
    """Return 6072h and 6073h for the force limit, rounded up: the controller limits before the drive."""
    drive = axis.drive
    torque_permille = axis.limits.force_n / drive_scaling(axis).newton_per_permille
    current_permille = (
        torque_permille * drive.rated_torque_mnm / drive.torque_constant_nm_a / drive.rated_current_ma
    )
    return math.floor(torque_permille) + 1, math.floor(current_permille) + 1


def drive_settings(machine: MachineConfig, axis_key: str, axis: AxisConfig) -> Iterator[Setting]:
    """Yield the settings of a drive: mode, stops, limits and homing, in device units.

    Raises ConfigError for a limit that no set point can represent.
    """
    scaling, limits = drive_scaling(axis), axis.limits
    count_per_mm = 1e-3 / scaling.metre_per_count
    unit_per_mm_s, unit_per_mm_s2 = 1e-3 / scaling.metre_per_s_per_unit, 1e-3 / scaling.metre_per_s2_per_unit
    correction_mm = _correction_mm(axis)
    lowest, highest = (
        round((mm + sign * correction_mm) * count_per_mm)
        for mm, sign in zip(limits.position_mm, (-1.0, 1.0), strict=True)
    )
    max_torque, max_current = force_limit_permille(axis)
    key, reason = "", ""
    if not -(2**31) <= lowest < highest < 2**31:
        key, reason = "position_mm", "is more than 32-bit counts can hold"
    elif axis.mode != "cst" and limits.velocity_mm_s * unit_per_mm_s >= 2**31:
        key, reason = "velocity_mm_s", f"is more than 32 bits of {axis.drive.velocity_unit} can hold"
    elif max_torque > 0x8000 or (axis.mode == "cst" and max_current > 0x10000):
        end = "a set point of 16 bits ends at 32767"
        key, reason = "force_n", f"is {max_torque - 1} per mille of rated_torque_mnm; {end}"
    if reason:
        raise ConfigError(machine.source, f"{axis_key}.limits.{key}", reason)
    deceleration = max(round(limits.acceleration_mm_s2 * unit_per_mm_s2), 1)
    fast, slow = (max(round(limits.velocity_mm_s * share * unit_per_mm_s), 1) for share in HOMING_SPEED_SHARE)
    yield (0x6060, 0, MODE_OF_NAME[axis.mode], "modes of operation")
    yield (0x605A, 0, QUICK_STOP_RAMP_THEN_DISABLE, "quick stop option code")
    yield (0x6085, 0, deceleration, "quick stop deceleration")
    yield (0x6007, 0, ABORT_CONNECTION_QUICK_STOP, "abort connection option code")
    yield (0x607D, 1, lowest, "min software position limit")
    yield (0x607D, 2, highest, "max software position limit")
    yield (0x6065, 0, round(limits.following_error_mm * count_per_mm), "following error window")
    yield (0x6072, 0, max_torque, "max torque")
    yield (0x6073, 0, max_current, "max current")
    if axis.homing_method != 0:
        yield (0x6098, 0, axis.homing_method, "homing method")
        yield (0x6099, 1, fast, "homing speed to the switch")
        yield (0x6099, 2, slow, "homing speed to the index")
        yield (0x609A, 0, max(round(deceleration * HOMING_SPEED_SHARE[0]), 1), "homing acceleration")
    value, exponent = interpolation_period(machine.bus.sync_period_us)
    yield (0x60C2, 1, value, "interpolation time period")
    yield (0x60C2, 2, exponent, "interpolation time index")


def _correction_mm(axis: AxisConfig) -> float:
    """Return how far the drive must allow a correction to move the motor beyond the table's limits."""
    sampled = axis.section(SampledDualLoopSettings)
    if sampled is None and axis.section(ScrewCompensationSettings) is None:
        return 0.0
    return axis.limits.following_error_mm + (sampled.limit_um * 1e-3 if sampled is not None else 0.0)


def interpolation_period(period_us: int) -> tuple[int, int]:
    """Return value and exponent of 60C2h: period = value * 10^exponent seconds, as near as 8 bits allow."""
    value, exponent = period_us, -6
    while value > 0xFF or (value % 10 == 0 and exponent < 0):
        value, exponent = round(value / 10), exponent + 1
    return value, exponent
