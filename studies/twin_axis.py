"""One axis of a machine in the batch twin, at power-up, and its set points of a program."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import PlantConfig, build_plant
from kernels.arrays import Array
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import program_segments
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.motion.program import Segment, Step
from twin.axis_rollout import AxisRollout

REST_CYCLES = 50
"""SYNC periods at standstill, drives enabled, before a motion; chosen."""


class TwinAxis(NamedTuple):
    """An axis of the twin, with the records of parameters and state of its plant, which the rollout uses."""

    rollout: AxisRollout
    plant_params: Any
    plant_state: Any


def twin_axis(machine: MachineConfig, plant: PlantConfig, axis: str, params: AxisParams) -> TwinAxis:
    """Build the plant of a machine, and the rollout of one of its axes with these control parameters."""
    built = build_plant(plant)
    index = list(plant.axes).index(axis)
    rollout = AxisRollout(machine, plant, axis, params, built)
    return TwinAxis(rollout, built.params[index], built.state[index])


def set_points(segment: Segment, column: int) -> Array:
    """Return set points (n, 4) of axis `column`: position m, velocity m/s, acceleration m/s^2, force N."""
    parts = (segment.position_m, segment.velocity_m_s, segment.acceleration_m_s2, segment.force_offset_n)
    return np.stack([part[:, column] for part in parts], axis=-1)


def motion(
    machine: MachineConfig, axis: str, steps: Sequence[Step], *, rest_cycles: int = REST_CYCLES
) -> Array:
    """Return the set points (n, 4) of one axis: standstill at zero, then the steps of a program."""
    column, start_m = list(machine.axes).index(axis), [0.0] * len(machine.axes)
    segments = program_segments(steps, machine, start_m)
    return np.concatenate(
        [np.zeros((rest_cycles, 4)), *(set_points(segment, column) for segment in segments)]
    )
