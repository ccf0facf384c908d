"""`servo-ctrl learn`: boot a machine on a bus, learn its compensations, stop in order."""

from enum import StrEnum
from typing import Annotated

import typer

from servo_ctrl.cli.options import (
    BusOption,
    FifoOption,
    LearnedOption,
    MachineOption,
    MqttOption,
    PacingChoice,
    PacingOption,
    RecordOption,
)


class LearnerChoice(StrEnum):
    """Learners, by what they learn and how."""

    FAST = "fast"
    PAPER = "paper"
    SCREW = "screw"
    WAVEFORM = "waveform"


def learn(
    machine: MachineOption,
    bus: BusOption,
    axes: Annotated[
        list[str] | None, typer.Option("--axis", help="Axis to learn, may be repeated; without it all.")
    ] = None,
    learner: Annotated[
        LearnerChoice | None,
        typer.Option(
            help="Friction pulse: fast, or paper (the published sweeps). waveform: force around reversals. "
            "screw: error table and lost motion.",
            show_default=False,
        ),
    ] = None,
    pacing: PacingOption = PacingChoice.REALTIME,
    learned: LearnedOption = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Discard the strokes of an interrupted run, and start again.")
    ] = False,
    record: RecordOption = None,
    mqtt: MqttOption = None,
    fifo: FifoOption = False,
) -> None:
    """Learn the friction compensation of a machine, or the errors of its screws, one axis after the other.

    Friction: sine strokes by `learning.radius_mm` to either side of the middle of the travel. Screw: slow
    travels over all of it. Keep the way clear. The result is stored as a new version and put into use if it
    is better than no compensation; otherwise, and after any failure, the previous version stays in use.
    Ctrl-C is safe: the same command continues interrupted learning of friction; a screw starts again. Exits
    with 0 when everything was learned, 1 after an error or a fault, 128 + n after signal n.

    Example:  servo-ctrl learn --machine machines/xy_table --bus socketcan:can0 --axis x
    """
    from servo_ctrl.cli.machine_run import MachineRun, learn_axes
    from servo_ctrl.daemon.run.run_options import LearningRequest

    learn_axes(
        MachineRun(
            machine=machine,
            bus=bus,
            pacing=pacing.value,
            record=record,
            learned=learned,
            mqtt=mqtt,
            fifo=fifo,
        ),
        LearningRequest(
            axes=tuple(axes or ()), learner=None if learner is None else learner.value, fresh=fresh
        ),
        resumable=learner not in {LearnerChoice.SCREW, LearnerChoice.WAVEFORM},
    )
