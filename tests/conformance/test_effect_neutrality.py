"""An effect with its neutral values changes no bit of the motion, in the rigid and in the elastic plant."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from hil_sim.config import build_plant, load_plant
from hil_sim.physics.quantities import effect_name
from hil_sim.physics.registry import EFFECTS
from hil_sim.physics.transmission import drive_compliance
from hil_sim.plant.integrate import advance
from hil_sim.plant.layout import fill, power_up

if TYPE_CHECKING:
    from types import ModuleType

XY_TABLE = Path(__file__).parents[2] / "machines" / "xy_table" / "plant.toml"
BY_DESIGN = [  # kept where nothing follows from them
    "temperature_k",
    "lubricant_warmth_k",
    "travelled_m",
    "contact_age",
    "lagged_a",
    "other_position_m",
]


def driven(effect: ModuleType, present: bool, elastic: bool) -> Any:
    config = load_plant(XY_TABLE)
    plant = build_plant(config)
    for axis in plant.params:
        if elastic:
            fill(axis["drive_compliance"], drive_compliance.Params(60e6, 3e3))
        else:
            axis["drive_compliance"]["enabled"] = 0
            axis["backlash"]["enabled"] = 0
        axis[effect_name(effect)]["enabled"] = 0
        if present:
            fill(axis[effect_name(effect)], effect.NEUTRAL)
    plant.state[:] = power_up(plant.params)
    plant.setpoint["loop"] = 1
    for k in range(200):
        plant.setpoint["current_a"] = 0.6 * np.sin(0.05 * k)
        advance(*plant, 20, config.dt_s)
    return plant.state


@pytest.mark.parametrize("elastic", [False, True], ids=["rigid", "elastic"])
@pytest.mark.parametrize("effect", [e for e in EFFECTS if e.NEUTRAL is not None], ids=effect_name)
def test_neutral_values_change_no_bit(effect: ModuleType, elastic: bool) -> None:
    if effect_name(effect) == "backlash" and not elastic:
        pytest.skip("backlash needs the stiffness of drive_compliance")
    without, neutral = driven(effect, False, elastic), driven(effect, True, elastic)
    assert np.abs(without["motor_position_m"]).min() > 1e-4
    for name in without.dtype.names:
        if name not in BY_DESIGN:
            assert np.array_equal(without[name], neutral[name]), name
