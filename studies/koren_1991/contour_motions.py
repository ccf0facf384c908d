"""Motions of the contour study in the batch twin, and their contour errors with and without coupling."""

from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import PlantConfig
from kernels.arrays import Array, rms
from servo_ctrl.config.contour_model import ContourControl
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import check_program
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.metrology.circles import analyse_circles
from servo_ctrl.metrology.contour_error import contour_error
from servo_ctrl.motion.program import Step
from servo_ctrl.plots.contour_traces import ContourTrace
from servo_ctrl.recording.reader import Recording
from studies.feng_2015.twin_motions import TwinProgram, twin_program
from twin.rollout import rollout

GAIN_1_S = 50.0
"""Gain of the coupling, 1/s; chosen by Ms alone, 1.96 on the table's masses with the observer of its file."""
FEEDS_MM_MIN, RADIUS_MM = (1000, 3000), 25.0
"""Feeds of the circles, and their radius; chosen."""
UM = 1e6


class Errors(NamedTuple):
    """Contour error of a motion, micrometres."""

    rms_um: float
    p99_um: float
    """Of 100 samples 99 are within it. The largest one of an outline is the lag where it begins."""


class Motions(NamedTuple):
    """Circles and a corner-rounded outline as set points."""

    circles: TwinProgram
    outline: TwinProgram
    outline_steps: list[Step]


def motions_of(machine: MachineConfig) -> Motions:
    """Return the motions within the limits of a machine."""
    folder = machine.source.parent / "programs"
    bracket = load_program(folder / "bracket.ngc", machine)
    return Motions(
        twin_program(machine, circles_of(machine)),
        twin_program(machine, bracket),
        check_program(bracket, machine),
    )


def circles_of(machine: MachineConfig) -> ProgramConfig:
    """Return a circle at each feed as a program."""
    steps: list[dict[str, Any]] = []
    for feed_mm_min in FEEDS_MM_MIN:
        start = {"label": f"to F {feed_mm_min}", "to_mm": {"x": RADIUS_MM, "y": 0.0}, "feed_mm_min": 6000.0}
        steps.append({"kind": "move", **start})
        circle = {"label": f"F {feed_mm_min}", "radius_mm": RADIUS_MM, "feed_mm_min": float(feed_mm_min)}
        steps.append({"kind": "circle", **circle, "turns": 1.3, "ramp_s": 0.5})
        steps.append({"kind": "move", "label": "home", "to_mm": {"x": 0.0, "y": 0.0}, "feed_mm_min": 6000.0})
    return ProgramConfig.model_validate({"source": machine.source, "step": steps})


def coupled(machine: MachineConfig, gain_1_s: float = GAIN_1_S) -> MachineConfig:
    """Return the machine with its two axes coupled."""
    section = ContourControl(axes=list(machine.axes), kp_1_s=gain_1_s)
    return machine.model_copy(update={"contour_control": section})


def contour_errors(
    machine: MachineConfig, plant: PlantConfig, motions: Motions, params: dict[str, AxisParams] | None = None
) -> dict[str, Errors]:
    """Return the errors of each motion: of circles over the last turn, of the outline at feed."""
    acting = params or {name: axis_params(machine, name) for name in machine.axes}
    found = {
        trace.label: _errors(trace.radial_error_m)
        for trace in circle_traces(machine, plant, motions.circles, acting)
    }
    recording = _recording(machine, plant, motions.outline, acting)
    outline = contour_error(recording, motions.outline_steps, machine)
    if outline is None:
        raise ValueError("the outline has no motion at feed")
    to_command = outline.to_command
    return {**found, "bracket.ngc": Errors(UM * to_command.rms_m, UM * to_command.p99_m)}


def circle_traces(
    machine: MachineConfig, plant: PlantConfig, circles: TwinProgram, params: dict[str, AxisParams]
) -> list[ContourTrace]:
    """Return the deviation from each circle over its last turn."""
    recording = _recording(machine, plant, circles, params)
    return [found.contour for found in analyse_circles(recording, machine.monitoring.window_s)]


def _recording(
    machine: MachineConfig, plant: PlantConfig, program: TwinProgram, params: dict[str, AxisParams]
) -> Recording:
    columns = rollout(machine, plant, params, program.reference)
    own: dict[str, Any] = {"segment": program.segment, "cycle": np.arange(len(program.segment))}
    return Recording(machine.source.parent, program.header, {**columns, **own})


def _errors(deviation_m: Array) -> Errors:
    return Errors(UM * rms(deviation_m), UM * float(np.percentile(np.abs(deviation_m), 99.0)))
