"""Random axes are measured, tuned for Ms 2 and measured again, in the batch twin: `make tune-random`.

The X-Y table's x axis with another table mass (20 to 200 kg), delay (up to 3 ms) and, four times of five, a
carried mass of 2 to 15 kg that swings at 20 to 200 Hz with a damping ratio of 0.005 to 0.05. Prints rows of
docs/tuning.md.
"""

import argparse
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hil_sim.config import PlantConfig
from servo_ctrl.canopen.scaling import drive_scaling, scale_metre_per_count
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.modal_model import antiresonances, resonances
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.excitation.multisine import multisine, travel
from servo_ctrl.tuning.frequency_response import FrequencyResponse, Measured, frequency_response
from servo_ctrl.tuning.gain_search import EncoderSteps
from servo_ctrl.tuning.modal_fit import fit_modal_model
from servo_ctrl.tuning.proposal import assess, propose
from servo_ctrl.tuning.session import GAIN_FACTORS
from studies.twin_axis import twin_axis
from twin.plant_file import load_plant

ROOT = Path(__file__).parents[3]
TABLE = ROOT / "machines" / "xy_table"
MEASURED_N, VERIFIED_N, SPEED_M_S, RAMP_S, PERIODS, REST = 30.0, 20.0, 0.01, 0.2, 4, 300
COHERENT, CALM_MS = 0.9, 8.0
"""Where the median coherence or Ms of a measurement is worse, it is made again with softer gains."""


def random_axes(seed: int, count: int) -> Iterator[tuple[float, float, tuple[float, float, float] | None]]:
    """Table mass (kg), delay (ms), and mass (kg), frequency (Hz), damping ratio of a mode."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        mass = float(rng.uniform(20, 200))
        mode_hz, damping = (
            float(np.exp(rng.uniform(np.log(low), np.log(high)))) for low, high in ((20, 200), (0.005, 0.05))
        )
        carried, delay = float(rng.uniform(2, 15)), float(rng.uniform(0, 3))
        mode = None if number % 5 == 4 else (round(carried, 2), round(mode_hz, 2), round(damping, 4))
        yield round(mass, 1), round(delay, 2), mode


def plant_with(mass_kg: float, delay_ms: float, mode: tuple[float, float, float] | None) -> PlantConfig:
    """The plant of the table with another x axis."""
    text = (TABLE / "plant.toml").read_text(encoding="utf-8").replace("../../eds", str(ROOT / "eds"))
    text = re.sub(r"(\[axis\.x\.table\]\nmass_kg = )[\d.]+", rf"\g<1>{mass_kg}", text)
    text += f"\n[axis.x.transport_delay]\ndelay_ms = {delay_ms}\n"
    if mode is not None:
        keys = "mass_kg = {}\nfrequency_hz = {}\ndamping_ratio = {}\n".format(*mode)
        text += f"\n[axis.x.structural_mode]\n{keys}"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "plant.toml"
        file.write_text(text, encoding="utf-8")
        return load_plant(file)


def measure(
    machine: MachineConfig, plant: PlantConfig, params: AxisParams, force_n: float
) -> FrequencyResponse:
    """There and back with the multisine."""
    excitation, axis = multisine(machine.period_s), twin_axis(machine, plant, "x", params).rollout
    unit_n, at_m, found = drive_scaling(machine.axes["x"]).newton_per_permille, 0.0, []
    axis.rows(np.zeros((50, 4)))
    for speed_m_s in (SPEED_M_S, -SPEED_M_S):
        one = travel(excitation, force_n, PERIODS, speed_m_s, RAMP_S, machine.period_s)
        position_m = at_m + one.position_m
        velocity = np.gradient(position_m, machine.period_s)
        motion = (position_m, velocity, np.gradient(velocity, machine.period_s), one.force_n)
        rows, at_m = axis.rows(np.column_stack(motion)), float(position_m[-1])
        axis.rows(np.column_stack((np.full(REST, at_m), np.zeros((REST, 3)))))
        part = slice(one.first, one.first + PERIODS * len(excitation.values))
        added = np.rint(one.force_n / unit_n) * unit_n
        whole = added + np.rint(rows["force_command_n"] / unit_n) * unit_n
        seen = (rows[name] - position_m for name in ("motor_position_m", "scale_position_m"))
        found.append(Measured(added[part], whole[part], *(values[part] for values in seen)))
    return frequency_response(found, len(excitation.values), excitation.lines, machine.period_s)


def measured_softly(machine: MachineConfig, plant: PlantConfig, params: AxisParams) -> FrequencyResponse:
    """With the first gains with which the axis is calm, on the motor."""
    response = None
    for kp, kv, ki in GAIN_FACTORS:
        position, velocity = params.position_loop, params.velocity_loop
        soft = params._replace(
            position_loop=position._replace(scale_feedback=False, kp_1_s=kp * position.kp_1_s),
            velocity_loop=velocity._replace(kv_n_s_m=kv * velocity.kv_n_s_m, ki_n_m=ki * velocity.ki_n_m),
        )
        response = measure(machine, plant, soft, MEASURED_N)
        calm = np.abs(response.sensitivity).max() < CALM_MS
        if calm and np.median(response.motor_coherence) > COHERENT:
            break
    assert response is not None
    return response


def main() -> None:
    """Print a row for each axis."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=20261124)
    parser.add_argument("--axes", type=int, default=10)
    options = parser.parse_args()
    machine = load_machine(TABLE)
    params = axis_params(machine, "x")
    config = machine.axes["x"]
    steps = EncoderSteps(drive_scaling(config).metre_per_count, scale_metre_per_count(config))
    for mass_kg, delay_ms, mode in random_axes(options.seed, options.axes):
        plant = plant_with(mass_kg, delay_ms, mode)
        response = measured_softly(machine, plant, params)
        model = fit_modal_model(response, machine.period_s)
        before = assess(params, model, response).margins
        proposal = propose(params, model, response, 2.0, steps)
        verified = measure(machine, plant, proposal.params, VERIFIED_N)
        rotor_kg = 25.0
        true_kg = mass_kg + rotor_kg + (0.0 if mode is None else mode[0])
        cells = [
            f"{true_kg:.1f}, {model.mass_kg:.1f} kg",
            f"{delay_ms:.2f}, {1e3 * model.delay_s:.2f} ms",
            "-" if mode is None else f"{mode[1]:.2f} Hz, {mode[2]:.4f}",
            " / ".join(f"{hz:.2f} Hz, {damping:.4f}" for hz, damping in antiresonances(model)) or "-",
            " / ".join(f"{one.frequency_hz:.2f} Hz, {one.damping_ratio:.4f}" for one in resonances(model))
            or "-",
            f"{before.sensitivity_peak:.2f}" if before.stable else "not stable",
            f"{proposal.assessment.margins.sensitivity_peak:.2f}, {np.abs(verified.sensitivity).max():.2f}",
        ]
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
