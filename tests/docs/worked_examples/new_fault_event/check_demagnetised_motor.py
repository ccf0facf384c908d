"""Runs in a copy of the tree that has the fault; see docs/development.md."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from hil_sim.faults.fault_target import FaultError, FaultTarget
from hil_sim.faults.schedule import Schedule, read_fault
from hil_sim.plant.layout import AXIS_PARAMS, AXIS_STATE


def target() -> FaultTarget:
    params = np.zeros(1, AXIS_PARAMS)[0]
    params["mechanics"]["force_constant_n_a"] = 50.0
    drive = cast("Any", SimpleNamespace())
    return FaultTarget(name="x", drive=drive, scale=None, params=params, state=np.zeros(1, AXIS_STATE)[0])


def test_the_motor_is_weaker_from_the_instant_on() -> None:
    axis = target()
    schedule = Schedule([read_fault("demagnetised_motor:x@0.5,kept=0.6")], {"x": axis})
    schedule.run(499_999)
    assert axis.params["mechanics"]["force_constant_n_a"] == 50.0
    schedule.run(500_000)
    assert axis.params["mechanics"]["force_constant_n_a"] == pytest.approx(30.0)


def test_a_share_beyond_its_bounds_is_refused() -> None:
    with pytest.raises(FaultError, match="kept is not within its bounds"):
        read_fault("demagnetised_motor:x@0.5,kept=1.2")
