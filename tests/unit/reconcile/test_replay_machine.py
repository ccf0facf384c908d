"""Our own recordings replayed: with the plant that made them they come back, with another they do not."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from hil_sim.config import load_plant
from reconcile.errors import ReconcileError
from reconcile.replay_machine import replay_machine
from reconcile.rollout import rollout
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil_sim.config import PlantConfig

    Array = NDArray[np.float64]

MACHINE = load_machine(Path(__file__).parents[3] / "machines" / "precision_stage")
OFF, CYCLES = 20, 1500


def plants() -> tuple[PlantConfig, PlantConfig]:
    """The machine's plant, and one with a quarter less Coulomb friction."""
    plant = load_plant(MACHINE.source.parent)
    axes = {}
    for name, axis in plant.axes.items():
        coulomb = axis.effects["coulomb_friction"]
        less = coulomb._replace(coulomb_n=0.75 * coulomb.coulomb_n)
        axes[name] = axis.model_copy(update={"effects": {**axis.effects, "coulomb_friction": less}})
    return plant, plant.model_copy(update={"axes": axes})


@pytest.fixture(scope="module")
def recorded() -> dict[str, Array]:
    """Columns as the daemon records them: no command before the axes are on, and none after the end."""
    t = np.arange(CYCLES) * MACHINE.period_s
    position_m = 2e-3 * (1.0 - np.cos(2.0 * np.pi * 1.5 * t)) * np.minimum(t / 0.2, 1.0) ** 3
    velocity_m_s = np.gradient(position_m, MACHINE.period_s)
    acceleration_m_s2 = np.gradient(velocity_m_s, MACHINE.period_s)
    reference = np.stack([position_m, velocity_m_s, acceleration_m_s2, np.zeros(CYCLES)], axis=1)
    reference[:OFF] = 0.0
    plant, _ = plants()
    columns = rollout(
        MACHINE,
        plant,
        {name: axis_params(MACHINE, name) for name in plant.axes},
        dict.fromkeys(plant.axes, reference),
        off_cycles=OFF,
    )
    for name in plant.axes:
        columns[f"{name}.position_command_m"][-10:] = np.nan
    return {**columns, "cycle": np.arange(CYCLES, dtype=np.float64)}


def test_the_plant_that_made_a_recording_gives_it_back(recorded: dict[str, Array]) -> None:
    true, other = plants()
    for name, found in replay_machine("r", recorded, MACHINE, true).items():
        assert len(found.time_s) == CYCLES - OFF - 10
        assert found.error().force_relative < 0.01
        worse = replay_machine("r", recorded, MACHINE, other)[name].error()
        assert worse.force_relative > 0.05
        assert worse.motor_rms_m > 3.0 * found.error().motor_rms_m


def test_missing_cycles_are_refused(recorded: dict[str, Array]) -> None:
    torn = {**recorded, "cycle": np.r_[np.arange(CYCLES - 1), CYCLES + 5]}
    with pytest.raises(ReconcileError, match="missing"):
        replay_machine("r", torn, MACHINE, plants()[0])


def test_a_recording_without_commands_is_refused(recorded: dict[str, Array]) -> None:
    silent = {**recorded, **{name: np.full(CYCLES, np.nan) for name in recorded if "command_m" in name}}
    with pytest.raises(ReconcileError, match="never commanded"):
        replay_machine("r", silent, MACHINE, plants()[0])
