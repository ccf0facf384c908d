"""`servo-ctrl check`: check machine, EDS files and program without a bus."""

from pathlib import Path
from typing import Annotated

import typer

from servo_ctrl.cli.options import BlockDeleteOption, G54Option, InputOption, MachineOption, ProgramOption


def check(
    machine: MachineOption,
    program: ProgramOption = None,
    inputs: InputOption = None,
    g54: G54Option = None,
    block_delete: BlockDeleteOption = False,
    out: Annotated[
        Path | None, typer.Option(help="Picture (PNG) of the program's path, coloured by speed.")
    ] = None,
) -> None:
    """Check a machine file, its EDS files and PDO mappings, and motions against the machine's limits.

    The motions are those of a program and of learning. No bus is needed. Exits with 0 when
    `servo-ctrl run` and `servo-ctrl learn` would get as far as the bus, else with 1 and one line that names
    file, key and reason.

    A program is computed without motion: its time, its extents, how near it gets to the limits, and for a
    part program (docs/part_programs.md) where it is slow and which words have no effect.

    Example:  servo-ctrl check --machine machines/xy_table --program machines/xy_table/programs/circles.toml
    """
    from servo_ctrl.canopen.bus_load import check_load
    from servo_ctrl.canopen.node import load_own_eds
    from servo_ctrl.canopen.plan import plan_machine
    from servo_ctrl.cli.option_values import read_program
    from servo_ctrl.cli.part_program_report import print_dry_run
    from servo_ctrl.config.contour import contour_note
    from servo_ctrl.config.dry_run import dry_run
    from servo_ctrl.config.load import load_machine
    from servo_ctrl.daemon.learning.axis_learning import LearningError
    from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
    from servo_ctrl.plots.path import plot_path

    config = load_machine(machine)
    load_own_eds(config)
    plans = plan_machine(config)
    chosen = read_program(program, config, inputs, g54, block_delete=block_delete)
    motion = MotionPlan(config, chosen)
    typer.echo(f"{config.source}: machine {config.machine.name}, {len(config.axes)} axes, {len(plans)} nodes")
    load = check_load(config, plans)
    bus = config.bus
    typer.echo(f"  bus: {100.0 * load:.0f} % of {bus.bit_rate_kbit_s} kbit/s every {bus.sync_period_us} us")
    for plan in plans:
        mapped = ", ".join(m.name for pdo in plan.pdos for m in pdo.codec.objects)
        typer.echo(f"  node {plan.node_id:3d}  {plan.key}: {mapped}")
    if note := contour_note(config):
        typer.echo(f"  {note}")
    if beyond_limits := [*motion.strokes_beyond_limits().values(), *motion.travels_beyond_limits().values()]:
        raise LearningError("; ".join(dict.fromkeys(beyond_limits)))
    if chosen is not None:
        result = dry_run(motion.steps, config)  # `MotionPlan` has checked the limits
        typer.echo(f"{program}: {len(motion.steps)} steps, {result.duration_s:.2f} s, within limits")
        print_dry_run(chosen, motion.steps, config, result)
        if out is not None:
            drawn = result.plot_m, result.plot_m_s, result.plot_rapid
            plot_path(out, list(config.axes), *drawn, chosen.source.name)
            typer.echo(f"picture: {out}")
