"""Sections of friction that changes, and the X-Y table that loses its lubrication."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from machine_files import XY_TABLE, plant_with, write_plant

from hil_sim.config import ConfigError, build_plant, load_plant
from hil_sim.physics.friction import friction_ageing, lubrication_loss, temperature_dependent_friction
from hil_sim.plant.integrate import advance

DRY_TABLE = XY_TABLE / "plant_lubrication_loss.toml"

CHANGES = """
[axis.x.temperature_dependent_friction]
warm_level_share = 0.7
warm_damping_share = 0.4
warmth_scale_k = 8.0
heat_capacity_j_k = 400.0
resistance_k_w = 2.0
[axis.x.lubrication_loss]
start_s = 60.0
transition_s = 2.0
level_factor = 1.8
damping_factor = 1.0
[axis.x.friction_ageing]
level_1_km = 20.0
damping_1_km = -5.0
"""


def test_sections_become_si(tmp_path: Path) -> None:
    effects = load_plant(plant_with(tmp_path, CHANGES)).axes["x"].effects
    assert effects["temperature_dependent_friction"] == temperature_dependent_friction.Params(
        0.7, 0.4, 8.0, 400.0, 2.0
    )
    assert effects["lubrication_loss"] == lubrication_loss.Params(60.0, 2.0, 1.8, 1.0)
    assert effects["friction_ageing"] == friction_ageing.Params(pytest.approx(0.02), pytest.approx(-0.005))


@pytest.mark.parametrize(
    ("old", "new", "key", "reason"),
    [
        (
            "level_factor = 1.8",
            "level_factor = -1",
            "lubrication_loss.level_factor",
            "-1 is not within 0 to 20",
        ),
        ("level_factor = 1.8", "", "lubrication_loss.level_factor", "missing"),
        ("transition_s = 2.0", "transition_s = 0", "lubrication_loss.transition_s", "not within 0.001"),
        ("start_s = 60.0", "start_ms = 60", "lubrication_loss.start_s", "missing"),
        ("start_s = 60.0", "start_s = nan", "lubrication_loss.start_s", "must be a number"),
        ("level_1_km = 20.0", "level_1_km = 1e4", "friction_ageing.level_1_km", "-1000 to 1000 1/km"),
        (
            "warmth_scale_k = 8.0",
            "warmth_scale_k = 0",
            "temperature_dependent_friction.warmth_scale_k",
            "0.1 to 200 K",
        ),
        ("damping_1_km = -5.0", "damping_1_km = -5.0\nx = 1", "friction_ageing.x", "unknown key"),
    ],
)
def test_error_names_key_and_reason(tmp_path: Path, old: str, new: str, key: str, reason: str) -> None:
    assert CHANGES.count(old) == 1
    with pytest.raises(ConfigError) as caught:
        load_plant(plant_with(tmp_path, CHANGES.replace(old, new)))
    assert caught.value.key == f"axis.x.{key}"
    assert reason in caught.value.reason


@pytest.mark.parametrize("effect", ["temperature_dependent_friction", "lubrication_loss", "friction_ageing"])
def test_friction_must_be_there_to_change(tmp_path: Path, effect: str) -> None:
    emps = (XY_TABLE.parent / "emps" / "plant.toml").read_text(encoding="utf-8")
    section = CHANGES.partition(f"[axis.x.{effect}]")[2].partition("[")[0]
    without = emps.replace("[axis.x.coulomb_friction]\ncoulomb_n = 20.394\n", "")
    assert len(without) < len(emps)
    file = write_plant(tmp_path, f"{without}\n[axis.x.{effect}]{section}")
    with pytest.raises(ConfigError, match=f"{effect}: needs the section coulomb_friction"):
        load_plant(file)


def test_dry_table_differs_from_the_table_in_its_lubrication_alone() -> None:
    table = tomllib.loads((XY_TABLE / "plant.toml").read_text(encoding="utf-8"))
    dry = tomllib.loads(DRY_TABLE.read_text(encoding="utf-8"))
    loss = dry["axis"]["x"].pop("lubrication_loss")
    assert dry == table
    assert loss == {"start_s": 60.0, "transition_s": 2.0, "level_factor": 1.8, "damping_factor": 1.0}


def test_dry_table_is_the_table_to_the_bit_until_its_lubrication_goes() -> None:
    """Both axes there and back at 5 mm/s; from 60 s on, x needs 80 % more than its levels, y stays."""
    table, dry = (load_plant(path) for path in (XY_TABLE, DRY_TABLE))
    plants = [build_plant(config) for config in (table, dry)]
    differ_s: dict[str, float] = {}
    for k in range(1300):
        for plant in plants:
            plant.setpoint["loop"] = 2
            plant.setpoint["velocity_m_s"] = 5e-3 if k % 100 < 50 else -5e-3
            advance(*plant, 1000, table.dt_s)
        for index, axis in enumerate(table.axes):
            if plants[0].state[index].tobytes() != plants[1].state[index].tobytes():
                differ_s.setdefault(axis, float(plants[0].state[index]["time_s"]))
    assert list(differ_s) == ["x"]
    assert differ_s["x"] == pytest.approx(60.05)
    level_n = table.axes["x"].effects["coulomb_friction"].coulomb_n
    rise = np.abs(plants[1].state["friction_n"]) - np.abs(plants[0].state["friction_n"])
    assert rise[0] == pytest.approx(0.8 * level_n, rel=0.02)
    assert rise[1] == 0.0
