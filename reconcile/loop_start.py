"""Before a loop moves anything: what it refuses, and the motion that it begins with."""

from __future__ import annotations

from typing import TYPE_CHECKING

from reconcile.errors import ReconcileError
from reconcile.next_experiment import Asked
from reconcile.next_experiment_pool import pool
from reconcile.next_experiment_program import program_steps, write_program

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from reconcile.model_file import NominalModel
    from reconcile.next_experiment_limits import Limits
    from servo_ctrl.config.model import MachineConfig

SLOWEST_M_S = 5e-4
FEWEST_COUNTS = 10.0
BEGINNING = "a bit of each"
"""Kind of the first motion."""
MM = 1e-3


def refuse_unsafe(machine: MachineConfig, model: NominalModel) -> None:
    """Raises ReconcileError: an axis that is not referenced, or that the controller does not know."""
    for name in model.axes:
        axis = machine.axes.get(name)
        if axis is None:
            known = ", ".join(machine.axes)
            raise ReconcileError(model.file, f"axis.{name}", f"the machine has no such axis, only {known}")
        if axis.homing_method == 0:
            raise ReconcileError(
                machine.source,
                f"axis.{name}.homing_method",
                "0: the axis is not referenced, so its limits of travel mean nothing",
                "give the homing method of its drive (37: where it stands is zero)",
            )


def first_program(machine: MachineConfig, limits: Mapping[str, Limits], out: Path) -> Path:
    """A bit of each motion, one axis after the other. Raises ReconcileError."""
    steps, words = [], []
    for name, within in limits.items():
        axis = machine.axes[name]
        finest_m = FEWEST_COUNTS * axis.transmission.lead_mm * MM / axis.drive.counts_per_rev
        motions = pool(within, machine.period_s, SLOWEST_M_S, finest_m)
        begin = next((one.motion for one in motions if one.motion.kind == BEGINNING), None)
        if begin is None:
            raise ReconcileError(
                machine.source, f"axis.{name}.limits", "no first motion fits in there", "give --program"
            )
        steps += program_steps(name, begin.steps)
        words.append(f"axis {name}: {begin.words}")
    file = write_program(Asked({"why": "; ".join(words)}, steps, BEGINNING, None), out)
    assert file is not None  # noqa: S101  # there are steps
    return file.rename(out / "first.toml")
