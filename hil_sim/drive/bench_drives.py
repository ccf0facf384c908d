"""All drives of a bench in one tick: one compiled call while all of them follow set points of the bus.

While any drive does something else (a ramp, homing, a profile mode), each drive computes its own tick.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hil_sim.config import Plant
from hil_sim.cyclic.drive_record import drive_records
from hil_sim.cyclic.drive_step import command_axes, supervise_axes
from hil_sim.drive import cia402_device as cia402
from hil_sim.drive.amplifier_device import Drive
from hil_sim.drive.cia402_device import State
from hil_sim.drive.cyclic_modes import FOLLOWS_COMMAND
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.node.pdo_tables import PdoTables
from hil_sim.node.slave import Slave
from hil_sim.plant.integrate import advance
from kernels.arrays import Array, Index

FOLLOWING = State.OPERATION_ENABLED | cia402.VOLTAGE_ENABLED | cia402.REMOTE | FOLLOWS_COMMAND
LIMITED = FOLLOWING | cia402.INTERNAL_LIMIT
"""Statuswords of a drive that follows set points of the bus, without and with an active limit."""


class BenchDrives:
    """The drives of a plant, in the order of its axes; their objects and records share one memory."""

    def __init__(self, drives: Sequence[Drive], plant: Plant, numbers: Array) -> None:
        """Move the process objects of the drives into `numbers` (drives, values)."""
        self.drives, self._plant = tuple(drives), plant
        self._axes = drive_records(len(drives))
        self._objects = numbers.view(DriveObjects.record()).reshape(-1)
        self._findings: Index = np.zeros(len(drives), np.int64)  # not 0: `read_axis` of that drive is called
        self._words: Index = np.array((FOLLOWING, LIMITED), np.int64)
        for index, drive in enumerate(drives):
            drive.move_to(self._axes[index : index + 1], numbers[index])

    def warm_up(self) -> None:
        """Compile the kernels of a tick, or load them from the cache; nothing moves."""
        plant = self._plant
        command_axes(self._axes, self._objects, plant.setpoint, 1.0, 1.0)
        advance(plant.params, plant.state, plant.setpoint, 0, 0.0)
        supervise_axes(self._axes[:0], self._objects[:0], plant.state[:0], 1.0, 0, 0, self._findings[:0])
        if self.drives:
            self.drives[0].port.warm_up()

    @property
    def slaves(self) -> list[Slave]:
        """The nodes of the drives."""
        return [drive.slave for drive in self.drives]

    @property
    def memory(self) -> tuple[Any, ...]:
        """Arguments of `serve_burst`, in its order."""
        plant = self._plant
        moved = plant.params, plant.state, plant.setpoint
        return *moved, self._axes, self._objects, self._words, self._findings

    @property
    def following(self) -> bool:
        """Whether all drives follow set points of the bus."""
        for drive in self.drives:  # noqa: SIM110  # called in every cycle, and `all` takes twice as long
            if not drive.follows_set_points:
                return False
        return True

    def exchange(self, tables: PdoTables) -> bytes:
        """Let the received RPDOs take effect; return the TPDO frames of all nodes as one burst."""
        frames = tables.exchange(self._axes, self._objects)
        return self.process(tables) if frames is None else frames

    def process(self, tables: PdoTables) -> bytes:
        """Let the drives act on new object values; return the TPDO frames of all nodes."""
        for drive, must_act in zip(self.drives, tables.acting, strict=True):
            if must_act:
                drive.process()
        return tables.fill()

    def advance(self, substeps: int, substep_s: float, dt_s: float, cycle_fraction: float) -> bool:
        """Command the axes and advance the plant by `substeps` of `substep_s`, together `dt_s`.

        `cycle_fraction` is `dt_s` in communication cycles. Returns `following` for `read`.
        """
        plant = self._plant
        following = self.following
        if following:
            command_axes(self._axes, self._objects, plant.setpoint, dt_s, cycle_fraction)
        else:
            for drive in self.drives:
                drive.command_axis(dt_s, cycle_fraction)
        advance(plant.params, plant.state, plant.setpoint, substeps, substep_s)
        return following

    def read(self, dt_s: float, *, following: bool) -> None:
        """Read the actual values of all axes and supervise them over the last `dt_s`."""
        if not following:
            for drive in self.drives:
                drive.read_axis(dt_s)
        elif supervise_axes(
            *(self._axes, self._objects, self._plant.state, dt_s), *(FOLLOWING, LIMITED, self._findings)
        ):
            self.handle_findings(dt_s)

    def handle_findings(self, dt_s: float) -> None:
        """Read and supervise the axes that had a finding in the last tick."""
        for drive, finding in zip(self.drives, self._findings, strict=True):
            if finding:
                drive.read_axis(dt_s)
