"""Before a loop moves anything: refuse unsafe machines, and write the first program."""

from collections.abc import Mapping
from pathlib import Path

from reconcile.design.candidate_motions import candidate_motions
from reconcile.design.limits import AxisLimits
from reconcile.design.program import program_steps, write_program
from reconcile.errors import ReconcileError
from reconcile.nominal_model.model_file import NominalModel
from servo_ctrl.config.model import MachineConfig

MIN_VELOCITY_M_S = 5e-4
MIN_STROKE_COUNTS = 10.0
"""Slower motion and smaller strokes may be noise; the sensors are unknown before the first recording."""
FIRST_KIND = "a bit of each"
"""Kind of the first motion."""
MM = 1e-3


def refuse_unsafe(machine: MachineConfig, model: NominalModel) -> None:
    """Raise ReconcileError for an axis that is not referenced, or that the controller does not have."""
    for name in model.axes:
        axis = machine.axes.get(name)
        if axis is None:
            known = ", ".join(machine.axes)
            raise ReconcileError(model.file, f"axis.{name}", f"the machine has no such axis, only {known}")
        if axis.homing_method == 0:
            reason = "0: the axis is not referenced, so its limits of travel mean nothing"
            remedy = "give the homing method of its drive (37: where it stands is zero)"
            raise ReconcileError(machine.source, f"axis.{name}.homing_method", reason, remedy)


def first_program(machine: MachineConfig, limits: Mapping[str, AxisLimits], out: Path) -> Path:
    """Write a program that excites one axis after the other. Raises ReconcileError."""
    steps, words = [], []
    for name, within in limits.items():
        axis = machine.axes[name]
        min_stroke_m = MIN_STROKE_COUNTS * axis.transmission.lead_mm * MM / axis.drive.counts_per_rev
        motions = candidate_motions(within, machine.period_s, MIN_VELOCITY_M_S, min_stroke_m)
        first = next((one.motion for one in motions if one.motion.kind == FIRST_KIND), None)
        if first is None:
            where = f"axis.{name}.limits"
            raise ReconcileError(machine.source, where, "no first motion fits in there", "give --program")
        steps += program_steps(name, first.steps)
        words.append(f"axis {name}: {first.words}")
    file = write_program(steps, "; ".join(words), out)
    assert file is not None  # noqa: S101  # there are steps
    return file.rename(out / "first.toml")
