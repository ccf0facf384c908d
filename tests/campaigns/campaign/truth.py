"""Records the true motion in the simulator: positions, speeds and power of every axis.

The controller has no access to it. Positions are those of the table relative to power-up, which homing by
method 37 makes the zero of the machine.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil_sim.runner.bench import SimulatedMachine

Array = np.ndarray[Any, np.dtype[np.float64]]
STANDSTILL_M_S, STANDSTILL_ROWS = 1e-4, 200


class Truth(NamedTuple):
    """Times and cycles (n,), values (n, axes); `cycle` as in `wire.Frame`."""

    time_s: Array
    cycle: Array
    position_m: Array
    motor_m: Array
    velocity_m_s: Array
    powered: Array
    enabled: Array
    """1 in operation enabled, else 0."""


class TruthRecorder:
    """Records a row after every advance of the plant."""

    def __init__(self, bench: SimulatedMachine, cycle: Callable[[], int]) -> None:
        self._rows: list[tuple[float, ...]] = []
        state = bench.plant.state
        positions: Any = state["table_position_m"].data
        motors: Any = state["motor_position_m"].data
        speeds: Any = state["table_velocity_m_s"].data
        drives = bench._drives.drives
        axes = range(len(drives))
        rows, clock = self._rows, bench.clock

        def record_row() -> None:
            rows.append(
                (
                    clock.now_us * 1e-6,
                    cycle(),
                    *(positions[axis] for axis in axes),
                    *(motors[axis] for axis in axes),
                    *(speeds[axis] for axis in axes),
                    *(drive.motion.powered for drive in drives),
                    *(drive.motion.powered and drive.state == 0x27 for drive in drives),
                )
            )

        bench.on_advanced = record_row
        self._axes = len(drives)
        self.start_m = [float(positions[axis]) for axis in axes]

    def is_at_standstill(self) -> bool:
        """Return whether no axis moved in the last rows."""
        speeds = slice(2 + 2 * self._axes, 2 + 3 * self._axes)
        return all(
            abs(speed) < STANDSTILL_M_S for row in self._rows[-STANDSTILL_ROWS:] for speed in row[speeds]
        )

    def truth(self) -> Truth:
        """Return all rows."""
        width = 2 + 5 * self._axes
        table = np.array(self._rows, dtype=np.float64).reshape(-1, width)
        parts = np.split(table[:, 2:], 5, axis=1)
        parts[0] = parts[0] - np.array(self.start_m)
        return Truth(table[:, 0], table[:, 1], *parts)
