"""PID against fuzzy-PD on the table of Xia et al., over the bus in lockstep (figures 6 to 8)."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.canopen.scaling import scale_metre_per_count
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.run.report import Progress
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.hil_rig.simulated_machine import simulated_machine
from servo_ctrl.hil_rig.simulated_run import RunError, new_recording
from servo_ctrl.recording.reader import Recording, load_recording
from studies.xia_fuzzy_pd.figures import SineFigures, StepFigures, sine_figures, step_figures, table_speed

AXIS = "x"
CONTROLLERS = {"pid": "controller_pid.toml", "fuzzy_pd": "controller.toml"}
"""Machine files of the compared laws."""
OPEN_LOOP = "controller_velocity.toml"
POSITION, VELOCITY = "programs/position.toml", "programs/velocity_step.toml"
STEP = ("step up", "held up", "step down", "held down")
SINE = ("sine",)
VELOCITY_STEP = ("rest", "velocity step")
"""Program steps that make up a motion."""


class Trace(NamedTuple):
    """One motion as recorded by the controller; arrays of one length, SI units."""

    time_s: Array
    """Time since its beginning."""
    command_m: Array
    command_m_s: Array
    scale_m: Array
    motor_m: Array
    table_m_s: Array
    """Table velocity, from the scale."""
    force_n: Array
    """Motor force, from the current."""


class LawResult(NamedTuple):
    """Figures and traces of one law."""

    step: StepFigures
    sine: SineFigures
    step_trace: Trace
    sine_trace: Trace
    count_pct: float
    """One count of the scale, per cent of the step: the resolution of the overshoot."""


async def run_law(machine: Path, law: str, out: Path, on_progress: Callable[[Progress], None]) -> LawResult:
    """Run step and sine with one law. Raises ServoCtrlError."""
    recording = await _run(machine, CONTROLLERS[law], POSITION, out, on_progress)
    config = load_machine(machine / CONTROLLERS[law])
    step, sine = (_trace(machine, CONTROLLERS[law], recording, labels) for labels in (STEP, SINE))
    try:
        return LawResult(
            step_figures(step.command_m, step.scale_m, config.period_s),
            sine_figures(sine.command_m, sine.scale_m, config.period_s),
            step,
            sine,
            scale_metre_per_count(config.axes[AXIS]) / float(np.ptp(step.command_m)) * 100.0,
        )
    except ValueError as error:
        raise RunError(f"{recording.directory}: {error}") from None


async def run_velocity_step(machine: Path, out: Path, on_progress: Callable[[Progress], None]) -> Trace:
    """Run a velocity step with an open position loop. Raises ServoCtrlError."""
    recording = await _run(machine, OPEN_LOOP, VELOCITY, out, on_progress)
    return _trace(machine, OPEN_LOOP, recording, VELOCITY_STEP)


async def _run(
    machine: Path, controller: str, program: str, out: Path, on_progress: Callable[[Progress], None]
) -> Recording:
    config = load_machine(machine / controller)
    motion = load_program(machine / program, config)
    directory = new_recording(out, f"{config.source.stem}-{motion.source.stem}")
    async with simulated_machine(machine, "lockstep") as bus:
        report = await run_machine(
            config, motion, bus, pacing="lockstep", record_dir=directory, on_progress=on_progress
        )
    if report.failed or not report.completed:
        raise RunError(f"the run was not completed: {report.reason}")
    return load_recording(directory)


def _trace(machine: Path, controller: str, recording: Recording, labels: tuple[str, ...]) -> Trace:
    """Return consecutive steps of a program as one motion. Raises RecordingError."""
    config = load_machine(machine / controller)
    parts = [recording.segment(label) for label in labels]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    axis = config.axes[AXIS]
    newton_per_ampere = axis.drive.torque_constant_nm_a * 2.0 * np.pi / (axis.transmission.lead_mm * 1e-3)
    time_s, scale_m = columns["time_s"], columns[f"{AXIS}.scale_position_m"]
    return Trace(
        time_s=time_s - time_s[0],
        command_m=columns[f"{AXIS}.position_command_m"],
        command_m_s=columns[f"{AXIS}.velocity_command_m_s"],
        scale_m=scale_m,
        motor_m=columns[f"{AXIS}.motor_position_m"],
        table_m_s=table_speed(scale_m, config.period_s),
        force_n=columns[f"{AXIS}.motor_current_a"] * newton_per_ampere,
    )


def study_figures(results: Mapping[str, LawResult]) -> dict[str, Any]:
    """Return the figures for JSON."""
    return {
        "step": {law: result.step._asdict() for law, result in results.items()},
        "sine": {law: result.sine._asdict() for law, result in results.items()},
        "overshoot_resolution_pct": results["fuzzy_pd"].count_pct,
        "missed": missed(results),
    }


def missed(results: Mapping[str, LawResult]) -> list[str]:
    """Return a sentence for each bar that fuzzy-PD misses."""
    pid, fuzzy = results["pid"], results["fuzzy_pd"]
    overshoot_pct, dead_s = fuzzy.step.overshoot_pct, fuzzy.sine.dead_time_s
    bars = {
        f"overshoots by {overshoot_pct:.2f} %, more than a count": overshoot_pct
        > fuzzy.count_pct * (1.0 + 1e-6),
        "its dead time is not below the PID law's": dead_s >= pid.sine.dead_time_s,
        "its RMS error is not below the PID law's": fuzzy.sine.rms_um >= pid.sine.rms_um,
    }
    return [f"fuzzy-PD: {sentence}" for sentence, is_missed in bars.items() if is_missed]
