"""An effect with its neutral values changes no bit of the motion, in the rigid and in the elastic plant."""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from hil_sim.config import build_plant, load_plant
from hil_sim.physics.registry import EFFECTS
from hil_sim.physics.transmission import drive_compliance
from hil_sim.plant.integrate import advance
from hil_sim.plant.layout import power_up, write_params
from kernels.quantities import section_of

XY_TABLE = Path(__file__).parents[2] / "machines" / "xy_table" / "plant.toml"


def driven(effect: ModuleType, present: bool, elastic: bool) -> Any:
    config = load_plant(XY_TABLE)
    plant = build_plant(config)
    for axis in plant.params:
        if elastic:
            write_params(axis["drive_compliance"], drive_compliance.Params(60e6, 3e3))
        else:
            axis["drive_compliance"]["enabled"] = 0
            axis["backlash"]["enabled"] = 0
        axis[section_of(effect)]["enabled"] = 0
        if present:
            write_params(axis[section_of(effect)], effect.NEUTRAL)
    plant.state[:] = power_up(plant.params)
    plant.setpoint["loop"] = 1
    for k in range(200):
        plant.setpoint["current_a"] = 0.6 * np.sin(0.05 * k)
        advance(*plant, 20, config.dt_s)
    return plant.state


@pytest.mark.parametrize("elastic", [False, True], ids=["rigid", "elastic"])
@pytest.mark.parametrize("effect", [e for e in EFFECTS if e.NEUTRAL is not None], ids=section_of)
def test_neutral_values_change_no_bit(effect: ModuleType, elastic: bool) -> None:
    if section_of(effect) == "backlash" and not elastic:
        pytest.skip("backlash needs the stiffness of drive_compliance")
    without, neutral = driven(effect, False, elastic), driven(effect, True, elastic)
    assert np.abs(without["motor_position_m"]).min() > 1e-4
    memories = {section_of(effect) for effect in EFFECTS}  # kept where nothing follows from them
    for name in without.dtype.names:
        if name not in memories:
            assert np.array_equal(without[name], neutral[name]), name
