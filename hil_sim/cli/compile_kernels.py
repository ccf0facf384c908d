"""`hil-sim compile`: compiles the kernels of the plant before its first start."""

import typer

from hil_sim.cli.options import MachineOption


def compile_kernels(machine: MachineOption) -> None:
    """Compile the kernels of a plant into the cache on disk; the next start only loads them."""
    from hil_sim.config import ConfigError, load_plant
    from hil_sim.runner.bench import SimulatedMachine

    try:
        SimulatedMachine(load_plant(machine), send=lambda _can_id, _data: None)
    except ConfigError as error:
        typer.echo(f"hil-sim: {error}", err=True)
        raise typer.Exit(1) from error
