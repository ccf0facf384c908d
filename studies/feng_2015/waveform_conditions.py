"""Machines and tables on which learned waveforms are measured: variations of `machines/xy_table`.

A condition changes the one key of the machine file that its name states, and no gains, except for longer
cycles: there all three gains are slower by one factor, the largest with which Ms on the rigid mass is at most
that at 1 ms.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import PlantConfig
from hil_sim.physics.transmission import backlash
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.loop_margins import sensitivity_peak
from studies.random_plants import FORCES, FRICTION_SHARE, MASS_SHARE, each_axis, random_plant, scaled

BACKLASH_GAP_M = 3e-6
STIFFNESS_SHARE = 0.7
"""Factor of a more compliant drive train; chosen: with half the stiffness the loop of y is unstable."""
PERIODS_US = (2000, 4000)
"""Cycle times of the conditions, microseconds; chosen."""
SCALES = np.geomspace(1.0, 0.1, 47)
"""Factors of the gains at longer cycles, in steps of 5 %; chosen."""


class Condition(NamedTuple):
    """A machine and its table."""

    name: str
    machine: MachineConfig
    plant: PlantConfig


def named_conditions(machine: MachineConfig, plant: PlantConfig) -> Iterator[Condition]:
    """Yield the machine as it is, then each variation by itself."""
    yield Condition("as it is", machine, plant)
    for sign in (-1.0, 1.0):
        share = sign * MASS_SHARE
        yield Condition(f"mass {100 * share:+.0f} %", machine, with_mass(plant, 1.0 + share))
    for sign in (-1.0, 1.0):
        share = sign * FRICTION_SHARE
        yield Condition(f"friction {100 * share:+.0f} %", machine, with_friction(plant, 1.0 + share))
    yield Condition("play 3 um", machine, with_backlash(plant, BACKLASH_GAP_M))
    yield Condition("drive train 30 % softer", machine, with_stiffness(plant, STIFFNESS_SHARE))
    yield Condition("motor feedback", with_motor_feedback(machine), plant)
    for period_us in PERIODS_US:
        yield Condition(f"cycle {period_us // 1000} ms", with_period(machine, period_us), plant)


def random_tables(machine: MachineConfig, plant: PlantConfig, count: int, seed: int) -> Iterator[Condition]:
    """Yield random tables: mass and every friction parameter drawn independently."""
    rng = np.random.default_rng(seed)
    for number in range(1, count + 1):
        yield Condition(f"table {number}", machine, random_plant(plant, rng))


def with_mass(plant: PlantConfig, share: float) -> PlantConfig:
    """Return the plant with the masses of its tables scaled; motors keep theirs."""
    return each_axis(
        plant,
        lambda axis: axis.model_copy(
            update={"table": axis.table.model_copy(update={"mass_kg": axis.table.mass_kg * share})}
        ),
    )


def with_friction(plant: PlantConfig, share: float) -> PlantConfig:
    """Return the plant with all friction forces scaled; their distances and speeds stay."""

    def changed(effects: dict[str, Any]) -> dict[str, Any]:
        return {
            key: effects[key]._replace(
                **{field: scaled(getattr(effects[key], field), share) for field in fields}
            )
            for key, fields in FORCES.items()
            if key in effects
        }

    return _with_effects(plant, changed)


def with_backlash(plant: PlantConfig, play_m: float) -> PlantConfig:
    """Return the plant with a backlash gap between nut and screw."""
    return _with_effects(plant, lambda _: {"backlash": backlash.Params(0.5 * play_m)})


def with_stiffness(plant: PlantConfig, share: float) -> PlantConfig:
    """Return the plant with the stiffness of its drive trains scaled."""

    def changed(effects: dict[str, Any]) -> dict[str, Any]:
        train = effects["drive_compliance"]
        return {"drive_compliance": train._replace(stiffness_n_m=share * train.stiffness_n_m)}

    return _with_effects(plant, changed)


def with_motor_feedback(machine: MachineConfig) -> MachineConfig:
    """Return the machine with the position loops closed on the motors."""
    return _with_control(machine, lambda _: {"feedback": "motor"})


def with_period(machine: MachineConfig, period_us: int) -> MachineConfig:
    """Return the machine with a longer cycle, and gains for it. Raises ValueError where none fit."""
    allowed = {name: _sensitivity(machine, name) for name in machine.axes}
    bus = machine.bus.model_copy(update={"sync_period_us": period_us})
    slower = machine.model_copy(update={"bus": bus})
    for scale in SCALES.tolist():
        found = _with_control(slower, partial(_scaled_gains, scale))
        if all(_sensitivity(found, name) <= allowed[name] for name in machine.axes):
            return found
    raise ValueError(f"no gains for a cycle of {period_us} us")


def _scaled_gains(scale: float, control: Any) -> dict[str, Any]:
    """Return all three gains slower by one factor: the same response on another time scale."""
    return {
        "kp_1_s": scale * control.kp_1_s,
        "kv_n_s_m": scale * control.kv_n_s_m,
        "ki_n_m": scale * scale * control.ki_n_m,
    }


def _sensitivity(machine: MachineConfig, axis: str) -> float:
    params = axis_params(machine, axis)
    return sensitivity_peak(params, params.feedforward.acceleration_kg)


def _with_control(machine: MachineConfig, change: Callable[[Any], dict[str, Any]]) -> MachineConfig:
    axes = {
        name: axis.model_copy(update={"control": axis.control.model_copy(update=change(axis.control))})
        for name, axis in machine.axes.items()
    }
    return machine.model_copy(update={"axes": axes})


def _with_effects(plant: PlantConfig, change: Callable[[dict[str, Any]], dict[str, Any]]) -> PlantConfig:
    return each_axis(
        plant, lambda axis: axis.model_copy(update={"effects": axis.effects | change(axis.effects)})
    )
