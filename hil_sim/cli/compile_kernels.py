"""`hil-sim compile`: the compiled kernels of the plant, made before its first start."""

import typer

from hil_sim.cli.options import MachineOption


def compile_kernels(machine: MachineOption) -> None:
    """Compile the kernels of a plant into the cache on the disk; its next start loads them in a second."""
    from hil_sim.config import ConfigError, load_plant
    from hil_sim.runner.bench import SimulatedMachine

    try:
        SimulatedMachine(load_plant(machine), send=lambda _can_id, _data: None)
    except ConfigError as error:
        typer.echo(f"hil-sim: {error}", err=True)
        raise typer.Exit(1) from error
