"""`servo-ctrl run`: boot a machine on a bus, run a program, stop in order."""

from servo_ctrl.cli.options import (
    BlockDeleteOption,
    BusOption,
    FifoOption,
    G54Option,
    HmiAccessOption,
    HmiCertificateOption,
    HmiKeyOption,
    HmiLanguageOption,
    HmiOption,
    HmiSocketOption,
    InputOption,
    LearnedOption,
    MachineOption,
    MqttOption,
    NoCompensationOption,
    ObserverOption,
    PacingChoice,
    PacingOption,
    ProgramOption,
    RecordOption,
    ServeOption,
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
    serve: ServeOption = False,
    learned: LearnedOption = None,
    no_compensation: NoCompensationOption = False,
    observer: ObserverOption = False,
    mqtt: MqttOption = None,
    fifo: FifoOption = False,
    hmi: HmiOption = None,
    hmi_access: HmiAccessOption = None,
    hmi_language: HmiLanguageOption = None,
    hmi_certificate: HmiCertificateOption = None,
    hmi_key: HmiKeyOption = None,
    hmi_socket: HmiSocketOption = None,
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
    from servo_ctrl.cli.machine_run import MachineRun, PageChoice, ProgramChoice, run_program

    run_program(
        MachineRun(
            machine=machine,
            bus=bus,
            pacing=pacing.value,
            record=record,
            learned=learned,
            mqtt=mqtt,
            fifo=fifo,
        ),
        ProgramChoice(program, inputs or (), g54, block_delete),
        PageChoice(
            listen=hmi,
            access=hmi_access,
            language=hmi_language,
            certificate=hmi_certificate,
            key=hmi_key,
            socket=hmi_socket,
        ),
        no_compensation=no_compensation,
        observer=observer,
        serve=serve,
    )
