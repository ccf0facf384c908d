"""`servo-ctrl tune`: measure the frequency response of an axis, propose gains and filters, verify them."""

from pathlib import Path
from typing import Annotated

import typer

from servo_ctrl.cli.options import MachineOption, PacingChoice, PacingOption, ProgressFormat

AxisOption = Annotated[str, typer.Option("--axis", help="Axis to tune.")]
TuneOutOption = Annotated[
    Path, typer.Option(help="Folder for report, figures, sections and recordings; made if absent.")
]
MsOption = Annotated[
    float,
    typer.Option(
        "--ms",
        min=1.2,  # as in files/tuning_files.py, which --help would have to load
        max=3.0,
        help="Largest sensitivity peak Ms: 1.4 is cautious, 2 usual at most.",
    ),
]
TuneBusOption = Annotated[
    str | None,
    typer.Option(
        help="INTERFACE:CHANNEL of python-can. Without it hil-sim is started on the plant.toml beside "
        "the machine file, in lockstep."
    ),
]
ControllerOption = Annotated[
    Path | None,
    typer.Option(
        help="Local socket of a controller (servo-ctrl run --hmi-socket) that is ready: it makes the "
        "motions, and stays in charge."
    ),
]
WhoOption = Annotated[
    str | None,
    typer.Option(
        hidden=True,
        help="With --controller: who asks, for its log, as `who` in docs/local_socket.md, JSON. The page "
        "names its visitor; without it, this system user.",
    ),
]
ForceOption = Annotated[
    float | None,
    typer.Option(
        min=0.0, help="Peak of the excitation, N; without it, derived from the reaction to a weak one."
    ),
]
ProgressOption = Annotated[
    ProgressFormat,
    typer.Option(help="text, or a line of JSON per step on standard error, for another program."),
]
ApplyOption = Annotated[
    bool,
    typer.Option(
        "--apply", help="Write proved values into the machine file; the file as it was stays beside it."
    ),
]


def tune(
    machine: MachineOption,
    axis: AxisOption,
    out: TuneOutOption = Path("out/tune"),
    ms: MsOption = 2.0,
    bus: TuneBusOption = None,
    controller: ControllerOption = None,
    who: WhoOption = None,
    pacing: PacingOption = PacingChoice.REALTIME,
    force_n: ForceOption = None,
    progress: ProgressOption = ProgressFormat.TEXT,
    apply: ApplyOption = False,
) -> None:
    """Measure the frequency response of an axis, propose gains, feedforward and a notch, and prove them.

    The axis travels slowly through the middle of its limits, there and back, while a small force with many
    frequencies is added (a multisine in torque_offset, 60B2h). Keep the way clear: it uses up to 80 % of the
    travel. Then it makes a step of force, a short move and a circle (one axis alone: a sine), with the
    present values and with the proposed ones.

    What is measured: force to motor and to scale, with coherence; mass, delay, and each resonance with
    frequency and damping. What is proposed: kp, kv, ki, feedforward, and a notch where it is worth it, so
    that a force moves the axis least while Ms, the largest |1 / (1 + L)|, stays below --ms: 2 leaves a phase
    margin of 29 degrees and a gain margin of 2 at least. What is proved: Ms measured with these values.

    --out gets report.html (Bode plots with margins, pictures of the proof), tuned.toml (the sections to put
    into the machine file, or use --apply) and tune.json (all figures). docs/tuning.md explains them.

    Ctrl-C is safe: the axes ramp down, the drives are switched off, and no file of the machine is
    changed. Exits with 0 when the proposal was proved, 1 when it was not or after a fault, 128 + n after
    signal n.

    Examples:  servo-ctrl tune --machine machines/xy_table --axis x --out out/tune

    servo-ctrl tune --machine mine --axis x --bus socketcan:can0 --ms 1.6 --out out/tune

    servo-ctrl tune --machine mine --axis x --controller /run/servo-ctrl/page.sock
    """
    from servo_ctrl.cli.tuning_run import tune_and_report

    tune_and_report(
        machine,
        axis,
        out,
        ms,
        force_n,
        bus,
        controller,
        who,
        pacing.value,
        as_json=progress is ProgressFormat.JSON,
        apply=apply,
    )
