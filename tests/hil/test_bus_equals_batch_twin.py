"""The same motion over the bus and in the batch twin: the same bits in every column."""

import asyncio
from pathlib import Path

import numpy as np
import pytest
from machine_files import XY_TABLE, text_of, without_sections
from program_steps import circle, dwell, move
from waveform_examples import example_waveform

from hil_sim.config import load_plant
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program import check_program, program_segments
from servo_ctrl.hil_rig.simulated_run import SimulatedRun, simulated_run
from servo_ctrl.learned.store import WaveformStore
from servo_ctrl.learning.reversal_waveform import WaveformLearned
from studies.feng_2015.waveform_learning import with_learned
from twin.axis_rollout import COLUMNS
from twin.rollout import rollout

ROOT = Path(__file__).parents[2]
SETPOINTS = {
    "cst": '"target_torque", "torque_offset"',
    "csv": '"target_velocity"',
    "csp": '"target_position"',
}
IMPOSSIBLE: dict[str, tuple[str, ...]] = {
    "cst": (),
    "csv": ("disturbance_observer",),
    "csp": ("disturbance_observer", "friction_compensation", "fuzzy_pd"),
}
"""Sections that need a set point that the mode does not have."""
PROGRAM = move(2.0, 0.0, 1000.0) + circle(2.0, 1500.0, turns=1.5)
WITH_RESTS = PROGRAM + dwell(0.3) + move(0.0, 0.0, 1000.0) + dwell(0.1) + move(1.0, 1.0, 1000.0)
# far too fast for a machine, so that a second shows it
EFFECTS_IT_LACKS = """
[axis.x.temperature_dependent_friction]
warm_level_share = 0.5
warm_damping_share = 0.5
warmth_scale_k = 0.1
heat_capacity_j_k = 1.0
resistance_k_w = 1.0
[axis.x.lubrication_loss]
start_s = 0.5
transition_s = 0.2
level_factor = 1.8
damping_factor = 0.8
[axis.y.friction_ageing]
level_1_km = 1000.0
damping_1_km = 1000.0
[axis.y.current_loop_lag]
time_ms = 0.3
[axis.y.transport_delay]
delay_ms = 0.4
[axis.y.presliding_hysteresis]
level_n = 5.0
way_um = 10.0
[axis.y.dwell_dependent_breakaway]
growth_n = 4.0
time_s = 0.2
way_um = 10.0
[axis.x.encoder_eccentricity]
amplitude_um = 5.0
phase_deg = 30.0
[axis.x.scale_cyclic_error]
amplitude_um = 0.5
period_um = 20.0
phase_deg = 30.0
[axis.x.cogging]
harmonic = [4.0]
amplitude_n = [3.0]
phase_deg = [0.0]  # no force where the table waits for its drives
[axis.y.lead_error_periodic]
amplitude_um = 3.0
harmonic = 1.0
phase_deg = 60.0
"""


def reference_of(run: SimulatedRun, program: Path) -> tuple[int, dict[str, np.ndarray]]:
    """Return the first cycle under control, and per axis the reference (n, 4): rest, then the program."""
    columns = run.recording.columns
    machine, axes = run.machine, run.recording.axes
    engaged = int(np.flatnonzero(np.isfinite(columns[f"{axes[0]}.position_command_m"]))[0])
    started = int(np.flatnonzero(columns["segment"] >= 0)[0])
    steps = check_program(load_program(program, machine), machine)
    pieces = list(program_segments(steps, machine, np.zeros(len(axes))))
    moving = [
        np.concatenate([getattr(piece, name) for piece in pieces])
        for name in ("position_m", "velocity_m_s", "acceleration_m_s2", "force_offset_n")
    ]
    reference = {}
    for index, axis in enumerate(axes):
        program_rows = np.column_stack([values[:, index] for values in moving])
        reference[axis] = np.vstack((np.zeros((started, 4)), program_rows))
    return engaged, reference


def machine_in_mode(mode: str, folder: Path, notch_hz: float = 80.0) -> Path:
    """Copy the X-Y table with its axes in `mode`, the set point of this mode, and a notch if possible."""
    folder.mkdir()
    for name in ("controller.toml", "plant.toml"):
        text = text_of(XY_TABLE / name)
        text = text.replace('mode = "cst"', f'mode = "{mode}"')
        if mode != "cst" and name == "controller.toml":  # what the amplifier closes takes no feedforward
            text = text.replace("acceleration_feedforward_kg = ", "acceleration_feedforward_kg = 0.0 # ")
        if mode == "csp" and name == "controller.toml":
            text = text.replace("velocity_feedforward = ", "velocity_feedforward = 0.0 # ")
        text = without_sections(text, *IMPOSSIBLE[mode])
        if mode != "csp" and name == "controller.toml":
            text += f"\n[axis.y.notch]\nfrequency_hz = {notch_hz}\n"
        if mode == "csp" and name == "controller.toml":
            text += '\n[axis.x.input_shaper]\nkind = "zvd"\nfrequency_hz = 33.0\n'
        (folder / name).write_text(text.replace(SETPOINTS["cst"], SETPOINTS[mode]))
    return folder


@pytest.mark.parametrize("mode", list(SETPOINTS))
def test_bus_and_batch_twin_give_the_same_bits(tmp_path: Path, mode: str) -> None:
    assert_the_same_bits(machine_in_mode(mode, tmp_path / "machine"), tmp_path)


def test_bus_and_batch_twin_give_the_same_bits_with_effects_that_the_table_lacks(tmp_path: Path) -> None:
    directory = machine_in_mode("cst", tmp_path / "machine")
    with (directory / "plant.toml").open("a") as plant:
        plant.write(EFFECTS_IT_LACKS)
    assert_the_same_bits(directory, tmp_path, example_waveform())


def test_bus_and_batch_twin_give_the_same_bits_with_contour_control(tmp_path: Path) -> None:
    # a notch at 80 Hz would take the phase that the coupling needs
    directory = machine_in_mode("cst", tmp_path / "machine", notch_hz=400.0)
    with (directory / "controller.toml").open("a") as file:
        file.write('\n[contour_control]\naxes = ["y", "x"]\nkp_1_s = 20.0\nki_1_s2 = 100.0\n')
    assert_the_same_bits(directory, tmp_path)


def assert_the_same_bits(directory: Path, folder: Path, learned: WaveformLearned | None = None) -> None:
    """Run `PROGRAM` over the bus and in the twin, or `WITH_RESTS` with a learned waveform of both axes."""
    program = folder / "program.toml"
    program.write_text(PROGRAM if learned is None else WITH_RESTS)
    machine = load_machine(directory)
    params = {axis: axis_params(machine, axis) for axis in machine.axes}
    if learned is not None:
        for axis in machine.axes:
            WaveformStore(folder / "learned", machine).add(axis, learned, {})
        params = {axis: with_learned(own, learned) for axis, own in params.items()}
    run = asyncio.run(
        simulated_run(
            directory,
            program,
            folder,
            lambda _progress: None,
            compensation="off" if learned is None else "waveform",
            learned=folder / "learned",
        )
    )
    engaged, reference = reference_of(run, program)
    twin = rollout(machine, load_plant(directory), params, reference, off_cycles=engaged)
    count = len(twin["time_s"])
    assert count > 1000
    for axis in machine.axes:
        assert np.ptp(twin[f"{axis}.scale_position_m"][engaged:]) > 3.9e-3  # it did move
        for name in COLUMNS:
            bus = run.recording.columns[f"{axis}.{name}"][engaged:count]
            np.testing.assert_array_equal(bus, twin[f"{axis}.{name}"][engaged:], err_msg=f"{axis}.{name}")
