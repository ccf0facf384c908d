"""Machine directories of axes on our own bus: controller, plant, and a program that excites every effect."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from kernels.arrays import Array

REPOSITORY = Path(__file__).parents[2]
PERIOD_S = 1e-3

CONTROLLER = """
[machine]
name = "concealed"
[bus]
sync_period_us = 1000
input_timeout_ms = 2000
[controller]
node_id = 127
eds = "EDS/servo_ctrl.eds"
heartbeat_ms = 100
[monitoring]
window_s = 0.2
"""
CONTROLLED_AXIS = """
[axis.NAME]
mode = "cst"
homing_method = 37
[axis.NAME.drive]
node_id = DRIVE
eds = "EDS/servo_drive.eds"
rpdo1 = ["controlword", "modes_of_operation", "target_torque", "torque_offset"]
tpdo1 = ["statusword", "position_actual_value", "current_actual_value"]
rpdo_transmission_type = 1
tpdo_transmission_type = 1
counts_per_rev = 1048576
rated_torque_mnm = 64        # chosen for resolution: one per mille is 0.04 N
rated_current_ma = 150
torque_constant_nm_a = 0.43
[axis.NAME.scale]
node_id = SCALE
eds = "EDS/linear_scale.eds"
tpdo1 = ["position_value"]
resolution_um = 0.1
[axis.NAME.transmission]
lead_mm = 10.0
[axis.NAME.limits]
position_mm = [-50.0, 50.0]
velocity_mm_s = 200.0
acceleration_mm_s2 = 2000.0
jerk_mm_s3 = 200000.0
force_n = 600.0
following_error_mm = 50.0   # some effects of the catalogue are larger here than on any machine
[axis.NAME.control]
feedback = "motor"
kp_1_s = 15.0
kv_n_s_m = 2500.0            # for the motor alone, where a play lets go of the table
ki_n_m = 25000.0
velocity_feedforward = 1.0
acceleration_feedforward_kg = 70.0
velocity_window_samples = 1
velocity_filter_ms = 0.0
"""
NOMINAL = """
[plant]
name = "concealed"
"""
NOMINAL_AXIS = """
[axis.NAME.drive]
node_id = DRIVE
eds = "EDS/servo_drive.eds"
[axis.NAME.scale]
node_id = SCALE
eds = "EDS/linear_scale.eds"
resolution_um = 0.1
[axis.NAME.motor]
rated_torque_mnm = 64
rated_current_ma = 150
torque_constant_nm_a = 0.43
inertia_kg_cm2 = 0.633
[axis.NAME.amplifier]
current_bandwidth_hz = 1000.0
voltage_limit_v = 325.0
peak_current_a = 4.5
position_gain_1_s = 15.0
velocity_gain_n_s_m = 2500.0
velocity_integral_n_m = 25000.0
velocity_feedforward = 1.0
velocity_filter_hz = 1000.0
[axis.NAME.transmission]
lead_mm = 10.0
[axis.NAME.table]
mass_kg = 45.0
start_mm = START_MM
[axis.NAME.encoder]
counts_per_rev = 1048576
[axis.NAME.limit_switches]
negative_mm = -60.0
positive_mm = 60.0
[axis.NAME.viscous_friction]
viscous_n_s_m = 80.0
[axis.NAME.coulomb_friction]
coulomb_n = 10.0
"""

ROUNDS = ((2.0, 60.0, 1.0), (1.0, 90.0, 1.25))
"""Slow and fast speed (mm/s) and sine (Hz). Two rounds, because the last quarter is held out."""


def motion() -> Array:
    """Return positions (n,) of an axis, rest at 0 to rest at 0: sines, constant speeds, small strokes."""
    return np.concatenate([piece for turn in _pieces() for piece in turn])


def motions(count: int) -> Array:
    """Return positions (n, count): the same pieces in a different order for each axis, uncorrelated."""
    orders = [[piece for turn in _pieces() for piece in (*turn[k:], *turn[:k])] for k in range(count)]
    return np.stack([np.concatenate(order) for order in orders], axis=1)


def _pieces() -> list[list[Array]]:
    """Return the pieces of each round, from rest at 0 to rest at 0."""
    return [
        [
            _sine(11e-3, sine_hz, 2),
            _there_and_back(0.7e-3 * slow_mm_s, slow_mm_s * 1e-3, 0.04),
            _there_and_back(16e-3, fast_mm_s * 1e-3, 1.0),
            _there_and_back(-4e-3, 8e-3, 0.1),
            _sine(4e-5, 2.0, 2),
            _there_and_back(-12e-3, 0.3 * fast_mm_s * 1e-3, 0.4),
        ]
        for slow_mm_s, fast_mm_s, sine_hz in ROUNDS
    ]


def _sine(amplitude_m: float, frequency_hz: float, cycles: int) -> Array:
    """Return cycles of a sine whose amplitude rises and falls over a quarter of a cycle."""
    turns = np.arange(1, round(cycles / frequency_hz / PERIOD_S) + 1) * frequency_hz * PERIOD_S
    swell = np.clip(np.minimum(turns, cycles - turns) / 0.25, 0.0, 1.0)
    return amplitude_m * swell**3 * (10.0 - 15.0 * swell + 6.0 * swell**2) * np.sin(2.0 * np.pi * turns)


def _there_and_back(stroke_m: float, speed_m_s: float, acceleration_m_s2: float) -> Array:
    """Return a stroke there and back at constant speed with smooth ramps, 50 ms of standstill after each."""
    ramp_cycles = max(round(speed_m_s / acceleration_m_s2 / PERIOD_S), 2)
    ramp = np.full(ramp_cycles, 1.0 / ramp_cycles)
    cruise = np.full(
        max(round(abs(stroke_m) / speed_m_s / PERIOD_S), 1), np.sign(stroke_m) * speed_m_s * PERIOD_S
    )
    cruise *= abs(stroke_m) / abs(cruise.sum())
    smooth_m = np.cumsum(np.convolve(np.convolve(cruise, ramp), np.ones(10) / 10.0))
    rest = np.full(50, smooth_m[-1])
    return np.concatenate((smooth_m, rest, smooth_m[-1] - smooth_m, 0.0 * rest))


def write_machine(
    folder: Path, concealed: Mapping[str, str], positions_m: Array, start_mm: float = 0.0
) -> Path:
    """Write a machine directory. `concealed`: by axis, the sections of the plant that the model lacks."""
    folder.mkdir(parents=True, exist_ok=True)

    def text(head: str, axis_text: str, more: Mapping[str, str]) -> str:
        parts = [head]
        for number, name in enumerate(concealed, start=1):
            own = axis_text + more.get(name, "")
            own = own.replace("DRIVE", str(number)).replace("SCALE", str(10 + number))
            parts.append(own.replace("NAME", name).replace("START_MM", repr(start_mm)))
        return "".join(parts).replace("EDS", str(REPOSITORY / "eds"))

    (folder / "controller.toml").write_text(text(CONTROLLER, CONTROLLED_AXIS, {}), encoding="utf-8")
    (folder / "plant.toml").write_text(text(NOMINAL, NOMINAL_AXIS, concealed), encoding="utf-8")
    columns = dict(zip(concealed, positions_m.T, strict=True))
    np.savez(folder / "motion.npz", time_s=np.arange(len(positions_m)) * PERIOD_S, **columns)
    named = ", ".join(f'{name} = "{name}"' for name in concealed)
    program = f'[[step]]\nkind = "samples"\nfile = "motion.npz"\nposition = {{ {named} }}\n'
    (folder / "program.toml").write_text(program, encoding="utf-8")
    return folder
