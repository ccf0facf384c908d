"""`servo-ctrl run`: boot a machine on a bus, run a program, stop in order."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from servo_ctrl.cli.options import (
    BlockDeleteOption,
    BusOption,
    FifoOption,
    G54Option,
    InputOption,
    LearnedOption,
    MachineOption,
    MqttOption,
    PacingChoice,
    PacingOption,
    ProgramOption,
    RecordOption,
)


def run(
    machine: MachineOption,
    bus: BusOption,
    program: ProgramOption = None,
    inputs: InputOption = None,
    g54: G54Option = None,
    block_delete: BlockDeleteOption = False,
    pacing: PacingOption = PacingChoice.REALTIME,
    record: RecordOption = None,
    serve: Annotated[
        bool, typer.Option("--serve", help="Hold the axes after the program and take commands (SDO, MQTT).")
    ] = False,
    learned: LearnedOption = None,
    no_compensation: Annotated[
        bool,
        typer.Option("--no-compensation", help="Without pulse, observer, screw table and sampled dual loop."),
    ] = False,
    observer: Annotated[
        bool, typer.Option("--observer", help="The disturbance observer acts instead of the learned pulse.")
    ] = False,
    mqtt: MqttOption = None,
    fifo: FifoOption = False,
    hmi: Annotated[
        str | None,
        typer.Option(
            metavar="HOST:PORT",
            help="Serve the operator's bench to browsers at this address (docs/operator_page.md). Without a "
            "program the drives stay off until somebody there enables them.",
        ),
    ] = None,
    hmi_access: Annotated[
        Path | None,
        typer.Option(help="File of tokens; for any address that others reach, as the next two."),
    ] = None,
    hmi_language: Annotated[
        Literal["en", "de"] | None,
        typer.Option(help="Language of the page until a visitor picks another; without it the browser's."),
    ] = None,
    hmi_certificate: Annotated[Path | None, typer.Option(help="TLS certificate of the page (PEM).")] = None,
    hmi_key: Annotated[Path | None, typer.Option(help="Key of that certificate (PEM).")] = None,
    hmi_socket: Annotated[
        Path | None,
        typer.Option(
            help="Make the page's socket here, in a directory of this user alone, and start no page: "
            "`python -m servo_ctrl.hmi serve --socket` does, as a service of its own.",
        ),
    ] = None,
) -> None:
    """Boot a machine on a CAN bus, run a program and stop.

    Every node is identified against its EDS and configured; nothing moves if anything is wrong. Ctrl-C or
    SIGTERM brings the axes to rest in step, switches the drives off and closes the recording; a second one
    lets the drives brake. Exits with 0 after a completed program, 1 after an error or a fault, 128 + n after
    signal n.

    In real time the computer is tested for two seconds first; missed requirements are the first event.

    The program is a TOML file (docs/programs.md) or G-code (docs/part_programs.md); when a part program was
    recorded, its contour error is printed at the end.

    The learned friction compensation acts where there is one (docs/learning.md). With --serve, and without
    a program, the axes stay under control until a signal comes, and can be commanded (docs/commands.md).
    With --hmi or --hmi-socket, and without a program, the drives are switched on and off from the operator's
    bench, and a fault is recovered from there; a signal ends the run.

    Example, with `hil-sim run --machine machines/xy_table --bus socketcan:vcan0` on the other side:

        servo-ctrl run --machine machines/xy_table --bus socketcan:vcan0 --pacing lockstep
        --program machines/xy_table/programs/circles.toml --record out/circles
    """
    import asyncio

    from servo_ctrl.cli.conclusion import conclude
    from servo_ctrl.cli.operator_page import page_at, url_of
    from servo_ctrl.cli.option_values import read_program, with_broker
    from servo_ctrl.cli.progress import progress_bar
    from servo_ctrl.config.load import load_machine
    from servo_ctrl.daemon.learning.pulse_compensation import Compensation
    from servo_ctrl.daemon.page.page_process import PageOptions
    from servo_ctrl.daemon.run.supervisor import run_machine

    if no_compensation and observer:
        raise typer.BadParameter("--no-compensation and --observer exclude each other")
    compensation: Compensation = "off" if no_compensation else "observer" if observer else "as configured"
    if hmi is None and (hmi_access or hmi_certificate or hmi_key):
        raise typer.BadParameter(
            "needs --hmi HOST:PORT", param_hint="--hmi-access, --hmi-certificate, --hmi-key"
        )
    if hmi is not None and hmi_socket is not None:
        raise typer.BadParameter("--hmi and --hmi-socket exclude each other")
    config = with_broker(load_machine(machine), mqtt)
    motion = read_program(program, config, inputs, g54, block_delete=block_delete)
    page = PageOptions(None, socket=hmi_socket) if hmi_socket is not None else None
    if hmi is not None:
        page = page_at(hmi, hmi_access, hmi_certificate, hmi_key, language=hmi_language)
        typer.echo(f"operator's bench: {url_of(hmi, tls=hmi_certificate is not None)}")
    with progress_bar() as show:
        report = asyncio.run(
            run_machine(
                config,
                motion,
                bus,
                pacing=pacing.value,
                record_dir=record,
                on_progress=show,
                fifo=fifo,
                serve=serve,
                learned_dir=learned,
                compensation=compensation,
                stand_by=page is not None and motion is None,
                page=page,
                self_test=True,
            )
        )
    conclude(config, report, motion)
