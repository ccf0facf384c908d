"""Closed-loop replay of our own recordings: the daemon's control law, as its machine directory has it.

The batch twin runs it cycle by cycle, every rounding included, so a model that holds all that acted gives the
recording back. Not in a recording, and so not in the replay: what was learned before it, the acceleration of
the command (taken from its velocity) and a force that a program added.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hil_sim.config import build_plant
from reconcile.axis_rollout import COLUMNS
from reconcile.errors import ReconcileError
from reconcile.replay import Replay
from reconcile.rollout import rollout_axis, substeps_of
from reconcile.wiring import wires_of
from servo_ctrl.config.freeze import axis_params

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from hil_sim.config import PlantConfig
    from servo_ctrl.config.model import MachineConfig

    Array = NDArray[np.float64]


def replay_machine(
    source: str, columns: Mapping[str, Array], machine: MachineConfig, plant: PlantConfig
) -> dict[str, Replay]:
    """By axis, for the columns of a recording from power-up on; up to where its commands end.

    Raises:
        ReconcileError: cycles are missing, or nothing was commanded.

    """
    if "cycle" in columns and (np.diff(columns["cycle"]) != 1).any():
        raise ReconcileError(source, "cycle", "cycles are missing", "replay a recording made in lockstep")
    return {name: _axis(source, columns, machine, plant, name) for name in plant.axes if name in machine.axes}


def _axis(
    source: str, columns: Mapping[str, Array], machine: MachineConfig, plant: PlantConfig, name: str
) -> Replay:
    position_m = columns[f"{name}.position_command_m"]
    led = np.flatnonzero(np.isfinite(position_m))
    if not len(led):
        raise ReconcileError(source, f"axis {name}", "was never commanded", "nothing can be replayed")
    first = int(led[0])
    gaps = np.flatnonzero(np.diff(led) > 1)
    end = int(led[gaps[0]] if len(gaps) else led[-1]) + 1
    reference = np.zeros((end, 4))
    reference[first:, 0] = position_m[first:end]
    reference[first:, 1] = np.nan_to_num(columns[f"{name}.velocity_command_m_s"][first:end])
    if end - first > 1:
        reference[first:, 2] = np.gradient(reference[first:, 1], machine.period_s)
    built, index = build_plant(plant), list(plant.axes).index(name)
    wires = wires_of(machine.axes[name], plant.axes[name])
    built.setpoint[index]["current_limit_a"] = wires.current_limit_a
    params, substeps = axis_params(machine, name), substeps_of(machine, plant)
    rows = rollout_axis(params, wires, built, index, substeps, plant.dt_s, reference, first)
    replayed = {column: rows[first:, place] for place, column in enumerate(COLUMNS)}
    recorded = {
        column: columns[f"{name}.{column}"][first:end] for column in COLUMNS if f"{name}.{column}" in columns
    }
    scale_m = recorded.get("scale_position_m")
    with_scale = scale_m is not None and bool(np.isfinite(scale_m).all()) and plant.axes[name].scale
    return Replay(
        f"{source}, axis {name}",
        np.arange(end - first, dtype=np.float64) * machine.period_s,
        recorded["motor_current_a"] * wires.newton_per_ampere,
        replayed["motor_current_a"] * wires.newton_per_ampere,
        recorded["motor_position_m"],
        replayed["motor_position_m"],
        scale_m if with_scale else None,
        replayed["scale_position_m"] if with_scale else None,
        0.0,
    )
