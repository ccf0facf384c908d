"""Bus load of a machine: cyclic frames as a share of the bit rate."""

from collections.abc import Sequence

from can_frames.frame import FRAME_BITS
from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.errors import ConfigError


def cyclic_load(machine: MachineConfig, plans: Sequence[NodePlan]) -> float:
    """Return SYNC, PDOs and heartbeats as a share of the bit rate, with the most stuff bits possible.

    Event-driven PDOs count at their inhibit time, or else at their event timer.
    """
    period_s = machine.period_s
    bits_s = FRAME_BITS[0] / period_s
    for plan in plans:
        for pdo in plan.pdos:
            bits_s += FRAME_BITS[pdo.codec.size] * _frames_per_s(
                pdo.transmission_type, pdo.event_timer_ms, pdo.inhibit_ms, period_s, received=pdo.received
            )
    if machine.controller.heartbeat_ms:
        bits_s += (len(plans) + 1) * FRAME_BITS[1] / (machine.controller.heartbeat_ms * 1e-3)
    return bits_s / (machine.bus.bit_rate_kbit_s * 1e3)


def check_load(machine: MachineConfig, plans: Sequence[NodePlan]) -> float:
    """Return the load. Raises ConfigError if the bus cannot carry a cycle."""
    load = cyclic_load(machine, plans)
    if load > 1.0:
        bus = machine.bus
        text = (
            f"a cycle of {bus.sync_period_us} us needs {100.0 * load:.0f} % of {bus.bit_rate_kbit_s} kbit/s"
        )
        reason = f"{text}; lengthen sync_period_us, or send less"
        raise ConfigError(machine.source, "bus.bit_rate_kbit_s", reason)
    return load


def _frames_per_s(
    transmission_type: int, timer_ms: int, inhibit_ms: float, period_s: float, *, received: bool
) -> float:
    if received:
        return 1.0 / period_s  # set points are sent every cycle, whatever the transmission type
    if 1 <= transmission_type <= 240:
        return 1.0 / (transmission_type * period_s)
    interval_ms = inhibit_ms or timer_ms
    return 1e3 / interval_ms if interval_ms else 0.0
