"""One axis made of the effects that a test names."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from hil_sim.config import Plant
from hil_sim.physics.sensor import encoder, scale
from hil_sim.plant import amplifier
from hil_sim.plant.integrate import advance
from hil_sim.plant.layout import AXIS_PARAMS, SETPOINT, Mechanics, power_up, write_params

DT_S = 50e-6
LEAD_M = 0.01
SCALE_M = 1e-9
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


class Observed(NamedTuple):
    """What can be measured on an axis, after every substep (n,)."""

    time_s: Any
    position_m: Any
    """Of the motor, as it is."""
    velocity_m_s: Any
    force_n: Any
    """By the reported current."""
    residual_n: Any
    """Force less mass times acceleration, of the masses in the data: friction and whatever else."""
    deviation_m: Any
    """Scale less encoder."""

    def where(self, mask: Any) -> Observed:
        """Some of the substeps."""
        return Observed(*(values[mask] for values in self))


class Bench:
    """An axis and its clock; `force_n` commands an ideal current, `each` sees every substep."""

    def __init__(self, motor_kg: float, table_kg: float, effects: dict[str, Any]) -> None:
        params = np.zeros(1, AXIS_PARAMS)
        write_params(params["mechanics"][0], Mechanics(LEAD_M, motor_kg, table_kg, FORCE_CONSTANT_N_A, 0.0))
        write_params(params["amplifier"][0], AMPLIFIER._replace(**effects.pop("amplifier_with", {})))
        write_params(params["encoder"][0], encoder.Params(LEAD_M / 2**20, 0.0))
        write_params(params["scale"][0], scale.Params(SCALE_M, 0.0))
        for name, values in effects.items():
            write_params(params[name][0], values)
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

    def observe(
        self,
        seconds: float,
        *,
        velocity: Callable[[float], float] | None = None,
        force: Callable[[float], float] | None = None,
    ) -> Observed:
        """The axis under a velocity or a force as a function of the time from now."""
        setpoint, state = self.plant.setpoint, self.state
        setpoint["loop"] = amplifier.VELOCITY if velocity else amplifier.CURRENT
        fields = ("motor_position_m", "motor_velocity_m_s", "current_a", "scale_counts", "encoder_counts")
        rows = np.empty((round(seconds / DT_S) + 1, len(fields)))
        rows[0] = [state[name] for name in fields]
        for k in range(1, len(rows)):
            if velocity:
                setpoint["velocity_m_s"] = velocity(k * DT_S)
            elif force:
                setpoint["current_a"] = force(k * DT_S) / FORCE_CONSTANT_N_A
            self.advance()
            rows[k] = [state[name] for name in fields]
        position, speed, current, scale_counts, encoder_counts = rows.T
        mechanics = self.plant.params[0]["mechanics"]
        mass_kg = mechanics["motor_mass_kg"] + mechanics["table_mass_kg"]
        return Observed(
            DT_S * np.arange(1, len(rows)),
            position[1:],
            speed[1:],
            FORCE_CONSTANT_N_A * current[1:],
            FORCE_CONSTANT_N_A * current[1:] - mass_kg * np.diff(speed) / DT_S,
            SCALE_M * scale_counts[1:] - LEAD_M / 2**20 * encoder_counts[1:],
        )

    def at_speeds(self, speeds_m_s: Any) -> tuple[Any, Any]:
        """Velocity (m/s), about as asked for, and force beyond inertia (N), one speed after the other."""
        runs = [self.observe(0.06, velocity=lambda _, v=v: v) for v in speeds_m_s]
        last = np.array([(run.velocity_m_s[-1], run.residual_n[-1]) for run in runs])
        return last[:, 0], last[:, 1]


@pytest.fixture
def bench() -> Callable[..., Bench]:
    def make(motor_kg: float = 20.0, table_kg: float = 50.0, **effects: Any) -> Bench:
        return Bench(motor_kg, table_kg, effects)

    return make
