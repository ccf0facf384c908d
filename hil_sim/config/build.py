"""Converts a PlantConfig to the records that the compiled plant reads."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hil_sim.config.model import AxisPlant, PlantConfig
from hil_sim.physics.sensor import encoder, scale
from hil_sim.plant.layout import AXIS_PARAMS, SETPOINT, Mechanics, power_up, write_params


class Plant(NamedTuple):
    """Records (axes,) of the plant, in the order of the file; `advance` changes `state` in place."""

    params: NDArray[Any]
    state: NDArray[Any]
    setpoint: NDArray[Any]


def build_plant(config: PlantConfig) -> Plant:
    """Return a plant at power-up: standstill at the start position, power off, limit at the peak current."""
    params = np.zeros(len(config.axes), AXIS_PARAMS)
    setpoint = np.zeros(len(config.axes), SETPOINT)
    for index, axis in enumerate(config.axes.values()):
        fill_axis(params[index], axis)
        setpoint[index]["current_limit_a"] = axis.amplifier.peak_current_a
    return Plant(params, power_up(params), setpoint)


def fill_axis(record: Any, axis: AxisPlant) -> None:
    """Write one axis into its AXIS_PARAMS record."""
    write_params(
        record["mechanics"],
        Mechanics(
            lead_m=axis.lead_m,
            motor_mass_kg=axis.motor_mass_kg,
            table_mass_kg=axis.table.mass_kg,
            force_constant_n_a=axis.force_constant_n_a,
            start_m=axis.table.start_mm * 1e-3,
        ),
    )
    write_params(record["amplifier"], axis.amplifier)
    write_params(
        record["encoder"],
        encoder.Params(axis.lead_m / axis.encoder.counts_per_rev, axis.encoder.index_mm * 1e-3),
    )
    if axis.scale:
        write_params(
            record["scale"],
            scale.Params(axis.scale.resolution_um * 1e-6, axis.scale.reference_mark_mm * 1e-3),
        )
    for name, values in axis.effects.items():
        write_params(record[name], values)
