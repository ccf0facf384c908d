"""Circles and S-shaped motions in the batch twin, with any force offset that is planned along the program."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hil_sim.config import PlantConfig
from kernels.arrays import Array
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import check_program, program_segments
from servo_ctrl.config.program_model import ProgramConfig, SShapeStep
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.metrology.circles import AXES, ReversalFigures, analyse_circles, figures_um
from servo_ctrl.recording.reader import Recording
from studies.feng_2015.s_shapes import analyse_s_shapes
from studies.twin_axis import set_points
from twin.rollout import rollout

SETTLE_CYCLES = 200
"""SYNC periods at standstill before the program; chosen."""
Planned = Callable[[str, Array], Array]
"""Maps an axis and its commands (n, 4) to a force offset (n,), newtons."""


class TwinProgram(NamedTuple):
    """A program as commands (n, 4) of each axis, with the header of its recording."""

    reference: dict[str, Array]
    segment: NDArray[np.int32]
    header: dict[str, Any]
    axis_of: dict[str, str]


def twin_program(machine: MachineConfig, program: ProgramConfig) -> TwinProgram:
    """Return the commands of a program, after SETTLE_CYCLES at standstill."""
    parts: dict[str, list[Array]] = {name: [np.zeros((SETTLE_CYCLES, 4))] for name in machine.axes}
    owner = [np.full(SETTLE_CYCLES, -1, np.int32)]
    steps: list[dict[str, Any]] = []
    for segment in program_segments(check_program(program, machine), machine, np.zeros(len(machine.axes))):
        if segment.step == len(steps):
            steps.append({"label": segment.label, "kind": segment.kind})
        owner.append(np.full(len(segment.position_m), segment.step, np.int32))
        for index, name in enumerate(machine.axes):
            parts[name].append(set_points(segment, index))
    header = {"segments": steps, "axes": list(machine.axes), "period_s": machine.period_s}
    axis_of = {step.label: step.axis for step in program.steps if isinstance(step, SShapeStep)}
    joined = {name: np.concatenate(part) for name, part in parts.items()}
    return TwinProgram(joined, np.concatenate(owner), header, axis_of)


def twin_figures(
    machine: MachineConfig,
    plant: PlantConfig,
    program: TwinProgram,
    params: dict[str, AxisParams],
    planned: Planned | None = None,
) -> dict[tuple[str, str], ReversalFigures]:
    """Return the four indicators, micrometres, by (axis or "S", label)."""
    reference = {name: commands.copy() for name, commands in program.reference.items()}
    if planned is not None:
        for name, commands in reference.items():
            commands[:, 3] += planned(name, commands)
    columns = rollout(machine, plant, params, reference)
    recording = Recording(machine.source.parent, program.header, {**columns, "segment": program.segment})
    window_s = machine.monitoring.window_s
    found = {
        (axis, circle.label): figures_um(circle.indicators[axis])
        for circle in analyse_circles(recording, window_s)
        for axis in AXES
    }
    shapes = analyse_s_shapes(recording, program.axis_of, window_s)
    return found | {("S", shape.name): shape.figures for shape in shapes}
