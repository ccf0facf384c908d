"""The batch twin: the daemon's cycle and the simulator's plant in one compiled loop, without a bus.

Order of operations and rounding to integers are those of the two processes on the bus, so that a rollout and
a recording are equal to the bit (`axis_rollout`). Axes that do not influence each other are simulated one
after the other; with contour control they are simulated together (`coupled_rollout`).
"""

import numpy as np

from hil_sim.config import PlantConfig, build_plant
from kernels.arrays import Array
from servo_ctrl.config.contour import couplings
from servo_ctrl.config.kernel_params import input_shaper
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.motion.input_shaper import shaped
from twin.axis_rollout import COLUMNS, AxisRollout
from twin.coupled_rollout import coupled_rows


class RolloutError(ServoCtrlError):
    """The daemon would stop this motion; the message has axis, event and time."""


def rollout(
    machine: MachineConfig,
    plant_config: PlantConfig,
    params: dict[str, AxisParams],
    reference: dict[str, Array],
    *,
    off_cycles: int = 0,
) -> dict[str, Array]:
    """Return the columns of a recording (n,) for set points `reference[axis]`, (n, 4) at the SYNC period.

    Columns of `reference`: position m, velocity m/s, acceleration m/s^2, force offset N. During the first
    `off_cycles` the drives have no power; then the position of each axis becomes its zero (homing method 37).

    Raises:
        ValueError: the period is not a whole number of substeps, or machine, plant and reference differ in
            axes.
        RolloutError: supervision has detected an event at which the daemon would stop.

    """
    plant = build_plant(plant_config)
    shaped_reference: dict[str, Array] = {}
    for name in plant_config.axes:
        if name not in reference or name not in machine.axes or name not in params:
            raise ValueError(f"axis {name} is in the plant but not in the controller's machine or reference")
        shaper = input_shaper(machine, name)
        shaped_reference[name] = reference[name] if shaper is None else shaped(reference[name], shaper)
    if couplings(machine):
        rows, events = coupled_rows(
            machine, plant_config, params, plant, reference=shaped_reference, off_cycles=off_cycles
        )
    else:
        rows, events = {}, {}
        for name, set_points in shaped_reference.items():
            axis = AxisRollout(machine, plant_config, name, params[name], plant)
            rows[name], events[name] = axis.rows(set_points, off_cycles), axis.findings
    columns: dict[str, Array] = {}
    length = 0
    for name, own in rows.items():
        if events[name]:
            event, cycle = min(events[name].items(), key=lambda first: first[1])
            after_s = cycle * machine.period_s
            raise RolloutError(
                f"axis {name}: {event.value} after {after_s:.3f} s, at which a run on the bus would stop"
            )
        columns.update({f"{name}.{column}": own[column] for column in COLUMNS})
        length = len(own)
    return {"time_s": np.arange(length, dtype=np.float64) * machine.period_s, **columns}
