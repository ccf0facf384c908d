"""Describes the machine in a recording: nodes, limits, and the compensations in use.

A report is made from the recording alone, perhaps years later, when the machine file has changed.
"""

from typing import Any

from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.control.compensation.fuzzy_pd import FuzzyPdSettings
from servo_ctrl.control.compensation.sampled_dual_loop import SampledDualLoopSettings
from servo_ctrl.units import MM


def setup_header(machine: MachineConfig) -> dict[str, Any]:
    """Return the keys `nodes`, `modes` and `limits` of recording.json."""
    nodes = [_node("controller", machine.controller.node_id, machine.controller.eds.name)]
    for name, axis in machine.axes.items():
        nodes.append(_node(f"axis.{name}.drive", axis.drive.node_id, axis.drive.eds.name))
        if axis.scale is not None:
            nodes.append(_node(f"axis.{name}.scale", axis.scale.node_id, axis.scale.eds.name))
    return {
        "nodes": nodes,
        "modes": {name: axis.mode for name, axis in machine.axes.items()},
        "limits": {name: _limits(axis) for name, axis in machine.axes.items()},
    }


def in_use_header(machine: MachineConfig, status: MachineStatus) -> dict[str, Any]:
    """Return the present keys `monitoring` and `compensation` of recording.json."""
    return {
        "monitoring": {"required_m": status.settings.required_m, "window_s": machine.monitoring.window_s},
        "compensation": {axis.name: _in_use(machine.axes[axis.name], axis) for axis in status.axes},
    }


def _node(name: str, node_id: int, eds: str) -> dict[str, Any]:
    return {"name": name, "node_id": node_id, "eds": eds}


def _limits(axis: AxisConfig) -> dict[str, Any]:
    limits = axis.limits
    return {
        "position_m": [end * MM for end in limits.position_mm],
        "velocity_m_s": limits.velocity_mm_s * MM,
        "acceleration_m_s2": limits.acceleration_mm_s2 * MM,
        "force_n": float(limits.force_n),
        "following_error_m": limits.following_error_mm * MM,
    }


def _in_use(config: AxisConfig, axis: AxisStatus) -> dict[str, Any]:
    return {
        "feedback": config.control.feedback,
        "fuzzy_pd": config.acts(FuzzyPdSettings),
        "sampled_dual_loop": config.acts(SampledDualLoopSettings),
        "pulse": axis.compensation_enabled,
        "version": axis.version,
        "learned_at": axis.learned_at,
        "observer": axis.observer_enabled,
        "screw": axis.screw.enabled,
        "screw_version": axis.screw.version,
        "screw_learned_at": axis.screw.learned_at,
        "waveform": axis.waveform.enabled,
        "waveform_version": axis.waveform.version,
        "waveform_learned_at": axis.waveform.learned_at,
    }
