"""`hil-sim run`: simulates the nodes of a machine on the bus until a signal ends it."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from hil_sim.cli.options import MachineOption


class Pacing(StrEnum):
    """What advances simulated time."""

    LOCKSTEP = "lockstep"
    REALTIME = "realtime"


BusOption = Annotated[
    str, typer.Option(help="INTERFACE:CHANNEL, e.g. socketcan:vcan0 or localcan:/tmp/bus.sock.")
]
PacingOption = Annotated[
    Pacing,
    typer.Option(help="lockstep: each SYNC advances time by object 1006h. realtime: the wall clock does."),
]
StateDirOption = Annotated[
    Path | None,
    typer.Option(help="Directory for stored parameters of the nodes (object 1010h). Default: memory."),
]
FifoOption = Annotated[
    bool, typer.Option("--fifo", help="SCHED_FIFO and locked memory; needs permission (root, or limits).")
]
FaultOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KIND:AXIS@SECONDS[,KEY=NUMBER]",
        help="A fault and its time in seconds since power-up, e.g. broken_scale:x@3.2. Repeatable.",
    ),
]


def run(
    machine: MachineOption,
    bus: BusOption,
    pacing: PacingOption = Pacing.LOCKSTEP,
    state_dir: StateDirOption = None,
    fifo: FifoOption = False,
    fault: FaultOption = None,
) -> None:
    """Simulate a machine's drives and scales on a CAN bus.

    The plant file names the nodes and their EDS files. The nodes boot, answer SDO and wait for an NMT start;
    a line on standard output reports them. SIGINT or SIGTERM ends the simulation. On a localcan bus this
    process becomes the server of the socket if there is none yet.

    A machine may have more than one plant file: machines/xy_table/plant_lubrication_loss.toml is the X-Y
    table whose x axis runs dry after a minute.

    Example:  hil-sim run --machine machines/xy_table --bus socketcan:vcan0
    """
    import asyncio

    from hil_sim.config import ConfigError, load_plant
    from hil_sim.faults.fault_target import FaultError
    from hil_sim.faults.schedule import read_fault
    from hil_sim.runner.bench import SimulatedMachine
    from hil_sim.runner.can_port import BusError, CanPort, open_bus
    from hil_sim.runner.process import serve
    from hil_sim.runner.realtime import RealtimeError

    def announce(bench: SimulatedMachine) -> None:
        nodes = ", ".join(f"{device.slave.node_id} (CiA {device.profile})" for device in bench.devices)
        typer.echo(f"hil-sim: on the bus: nodes {nodes}")

    def open_port() -> CanPort:
        port = CanPort(open_bus(bus))
        if port.serves:
            typer.echo(f"hil-sim: serves the bus {bus}")
        return port

    try:
        config = load_plant(machine)
        faults = [read_fault(text) for text in fault or ()]
        asyncio.run(
            serve(
                config,
                open_port,
                realtime=pacing is Pacing.REALTIME,
                fifo=fifo,
                state_directory=state_dir,
                on_ready=announce,
                faults=faults,
            )
        )
    except (ConfigError, FaultError, BusError, RealtimeError) as error:
        typer.echo(f"hil-sim: {error}", err=True)
        raise typer.Exit(1) from error
