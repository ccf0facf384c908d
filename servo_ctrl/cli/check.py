"""`servo-ctrl check`: everything that can be wrong without a bus."""

from __future__ import annotations

import typer

from servo_ctrl.canopen.node import own_dictionary
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.cli.options import (  # typer reads the annotations at run time
    InputOption,
    MachineOption,
    ProgramOption,
    read_program,
)
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.axis_learning import LearningError
from servo_ctrl.daemon.motion_plan import MotionPlan


def check(
    machine: MachineOption,
    program: ProgramOption = None,
    inputs: InputOption = None,
) -> None:
    """Check a machine file, its EDS files and PDO mappings, and motions against the machine's limits.

    The motions are those of a program and the strokes of learning. No bus is needed. Exits with 0 when
    `servo-ctrl run` and `servo-ctrl learn` would come as far as the bus, else with 1 and one line that names
    file, key and reason.

    Example:  servo-ctrl check --machine machines/xy_table --program machines/xy_table/programs/circles.toml
    """
    config = load_machine(machine)
    own_dictionary(config)
    plans = plan_machine(config)
    motion = MotionPlan(config, read_program(program, config, inputs))
    typer.echo(f"{config.source}: machine {config.machine.name}, {len(config.axes)} axes, {len(plans)} nodes")
    for plan in plans:
        mapped = ", ".join(m.name for pdo in plan.pdos for m in pdo.codec.objects)
        typer.echo(f"  node {plan.node_id:3d}  {plan.key}: {mapped}")
    if beyond := motion.strokes_beyond_limits():
        raise LearningError("; ".join(dict.fromkeys(beyond.values())))
    if program is not None:
        motion.prepare([0.0] * len(config.axes))
        typer.echo(
            f"{program}: {len(motion.steps)} steps, {motion.cycles * config.period_s:.2f} s, within limits"
        )
