"""One axis made of the effects that a test names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from hil_sim.config import Plant
from hil_sim.physics.sensor import encoder
from hil_sim.plant import amplifier
from hil_sim.plant.integrate import advance
from hil_sim.plant.layout import AXIS_PARAMS, SETPOINT, Mechanics, fill, power_up

if TYPE_CHECKING:
    from collections.abc import Callable

DT_S = 50e-6
LEAD_M = 0.01
FORCE_CONSTANT_N_A = 250.0

AMPLIFIER = amplifier.Params(
    current_bandwidth_hz=1000.0,
    voltage_limit_v=300.0,
    peak_current_a=10.0,
    position_gain_1_s=40.0,
    velocity_gain_n_s_m=15e3,
    velocity_integral_n_m=500e3,
    velocity_feedforward=1.0,
    velocity_filter_hz=1000.0,
)


class Bench:
    """An axis and its clock; `force_n` commands an ideal current, `each` sees every substep."""

    def __init__(self, motor_kg: float, table_kg: float, effects: dict[str, Any]) -> None:
        params = np.zeros(1, AXIS_PARAMS)
        fill(params["mechanics"][0], Mechanics(LEAD_M, motor_kg, table_kg, FORCE_CONSTANT_N_A, 0.0))
        fill(params["amplifier"][0], AMPLIFIER._replace(**effects.pop("amplifier_with", {})))
        fill(params["encoder"][0], encoder.Params(LEAD_M / 2**20, 0.0))
        for name, values in effects.items():
            fill(params[name][0], values)
        self.plant = Plant(params, power_up(params), np.zeros(1, SETPOINT))
        self.plant.setpoint["current_limit_a"] = 10.0

    @property
    def state(self) -> Any:
        return self.plant.state[0]

    def force(self, force_n: float) -> None:
        self.plant.setpoint["loop"] = amplifier.CURRENT
        self.plant.setpoint["current_a"] = force_n / FORCE_CONSTANT_N_A

    def advance(self, substeps: int = 1) -> None:
        advance(*self.plant, substeps, DT_S)

    def record(self, force_n: Callable[[float], float], seconds: float, *names: str) -> dict[str, Any]:
        """Signals after every substep under a force as a function of time."""
        columns: dict[str, list[float]] = {name: [] for name in names}
        for k in range(round(seconds / DT_S)):
            self.force(force_n(k * DT_S))
            self.advance()
            for name in names:
                columns[name].append(float(self.state[name]))
        return {name: np.array(values) for name, values in columns.items()}


@pytest.fixture
def bench() -> Callable[..., Bench]:
    def make(motor_kg: float = 20.0, table_kg: float = 50.0, **effects: Any) -> Bench:
        return Bench(motor_kg, table_kg, effects)

    return make
