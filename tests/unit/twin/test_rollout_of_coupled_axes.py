"""Coupled axes cannot be rolled out independently."""

from pathlib import Path

import numpy as np
import pytest

from hil_sim.config import load_plant
from hil_sim.physics.sensor import cross_axis_coupling
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine
from twin.rollout import rollout

XY_TABLE = Path(__file__).parents[3] / "machines" / "xy_table"


def test_the_twin_refuses_coupled_axes_with_a_reason() -> None:
    machine, plant = load_machine(XY_TABLE), load_plant(XY_TABLE)
    effects = plant.axes["y"].effects | {"cross_axis_coupling": cross_axis_coupling.Params(0.0, 50e-6)}
    axes = plant.axes | {"y": plant.axes["y"].model_copy(update={"effects": effects})}
    with pytest.raises(ValueError, match="cross_axis_coupling: in the batch twin each axis runs by itself"):
        rollout(
            machine,
            plant.model_copy(update={"axes": axes}),
            {axis: axis_params(machine, axis) for axis in axes},
            {axis: np.zeros((2, 4)) for axis in axes},
        )
