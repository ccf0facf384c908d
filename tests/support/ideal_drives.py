"""The machine with ideal drives (CSP, no dynamics, no delay), alone or with the daemon's services."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from machine_files import XY_TABLE, text_of, without_sections, write_controller
from program_steps import circle, dwell

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.commands.command import Command, CommandRequest, CommandResult
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.program import program_segments
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.cycle.missing_inputs import Tolerance
from servo_ctrl.daemon.run.assemble import build_axes
from servo_ctrl.daemon.run.run_options import RunOptions
from servo_ctrl.daemon.run.services import Services
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.motion.move import Dwell, Move

PERIOD_S = 0.001
COUNT_M = 0.010 / 2**20
SCALE_COUNT_M = 1e-7
ROUND = circle(5.0, 3000.0) + dwell(0.05)
AWAY = Move("away", (0.002, 0.001), 0.02, np.inf, trapezoidal=False)


def ideal_machine_file(directory: Path, *, homing_method: int = 0) -> Path:
    """The X-Y table in CSP, without compensations that need a force or a velocity set point."""
    changes = {
        "homing_method = 37": f"homing_method = {homing_method}",
        'mode = "cst"': 'mode = "csp"',
        '"target_torque", "torque_offset"': '"target_position"',
        "velocity_feedforward = ": "velocity_feedforward = 0.0 # ",
        "acceleration_feedforward_kg = ": "acceleration_feedforward_kg = 0.0 # ",
    }
    text = text_of(XY_TABLE / "controller.toml", changes)
    sections = ("friction_compensation", "disturbance_observer", "fuzzy_pd")
    return write_controller(directory, without_sections(text, *sections))


HOMING = 6
STATUSWORDS = {
    0x06: 0x0221,
    0x07: 0x0223,
    0x0F: 0x0227,
    0x1F: 0x1627,
    0x02: 0x0240,
    0x00: 0x0240,
    0x80: 0x0240,
}
"""Statusword of a drive after a controlword; 1Fh homes it at its present position."""


class IdealDrive:
    """Follows a controlword and a target position without delay; a fault switches it off until its reset."""

    def __init__(self) -> None:
        self.statusword = 0x0240
        self.position = 0
        self.controlwords: list[int] = []
        """Controlwords that it has executed."""

    def obey(self, controlword: int, position: int, mode: int = 8) -> None:
        if self.statusword == 0x0208 and controlword != 0x80:
            return
        self.controlwords.append(controlword)
        self.statusword = STATUSWORDS[controlword]
        if controlword == 0x1F:
            self.position = 0
        elif self.statusword == 0x0227 and mode != HOMING:
            self.position = position


class Stand:
    """A machine of two axes and its nodes: drive x, scale x, drive y, scale y."""

    def __init__(self, machine_file: Path, missing_tolerated: int = 5) -> None:
        self.config = load_machine(machine_file)
        plans = plan_machine(self.config)
        self.places = build_axes(self.config, plans)
        self.drives = [IdealDrive(), IdealDrive()]
        self.codecs = [plan.rpdo.codec for plan in plans if len(plan.pdos) > 1]
        self._pack = [plan.tpdo.codec.pack for plan in plans]
        self.rows: list[list[float]] = []
        self.faults: list[tuple[Event, str]] = []
        self.ready = self.rests = 0
        self.stops: list[str] = []
        self.cycle = -1
        self.absent: set[int] = set()
        self.on = True
        self.machine = machine = MachineController(
            self.places, ["dx", "sx", "dy", "sy"], PERIOD_S, Tolerance(missing_tolerated, 300)
        )
        machine.record = self.rows.append
        machine.on_ready, machine.on_rest, machine.on_stop = self._on_ready, self._on_rest, self.stops.append
        machine.on_fault = lambda event, text: self.faults.append((event, text))
        machine.begin()

    def _on_ready(self) -> None:
        self.ready += 1

    def _on_rest(self) -> None:
        self.rests += 1

    def run(self, cycles: int, elapsed: int = 1) -> Stand:
        """Run `cycles` cycles, or fewer when the machine switches off."""
        for _ in range(cycles):
            if not self.on:
                break
            self.cycle += elapsed
            values: list[tuple[int, ...]] = []
            for drive in self.drives:
                values += [
                    (drive.statusword, drive.position, 0),
                    (round(drive.position * COUNT_M / SCALE_COUNT_M),),
                ]
            inputs: list[Any] = [pack(*own) for pack, own in zip(self._pack, values, strict=True)]
            for node in self.absent:
                inputs[node] = None
                self.machine.input_missing(node)
            payloads = self.machine.tick(self.cycle, elapsed, inputs)
            if payloads is None:
                self.on = False
                break
            for drive, codec, payload in zip(self.drives, self.codecs, payloads, strict=True):
                controlword, mode, position = codec.unpack(payload)
                drive.obey(controlword, position, mode)
        return self

    def start(self) -> Stand:
        """Switch on and run to the middle of a move."""
        self.run(60)
        steps = [AWAY, Dwell("rest", 0.05)]
        self.machine.run(ProgramReference(program_segments(steps, self.config, self.machine.set_points_m())))
        return self.run(60)

    def positions_m(self) -> list[float]:
        return [drive.position * COUNT_M for drive in self.drives]


class OperatedStand(Stand):
    """The machine with the daemon's services, operated by commands; no standby if `stand_by` is false."""

    def __init__(self, machine_file: Path, learned: Path, **options: Any) -> None:
        super().__init__(machine_file)
        motion = MotionPlan(self.config, options.pop("program", None))
        lockstep = options.pop("lockstep", True)
        usual = RunOptions(
            serve=False, learned_dir=learned, compensation="as configured", learn=None, stand_by=True
        )
        servos = [place.servo for place in self.places]
        self.services = Services(
            self.config, motion, self.machine, servos, usual._replace(**options), lockstep=lockstep
        )
        self.services.rows.stream = self.rows.append
        self.services.begin()

    @property
    def handler(self) -> Any:
        return self.services.handler

    @property
    def status(self) -> MachineStatus:
        return self.services.handler.status()

    def commanded_m(self) -> np.ndarray:
        """Position commands of both axes, (n, 2), of the cycles that have them."""
        both = np.array([[row[3], row[15]] for row in self.rows])
        return both[np.isfinite(both).all(axis=1)]

    def ask(self, command: Command, axis: str = "") -> CommandResult:
        """Give a command."""
        verdict: CommandResult = self.handler.execute(CommandRequest(command, axis))
        return verdict


Operate = Callable[..., OperatedStand]
"""A fixture that makes machines."""
