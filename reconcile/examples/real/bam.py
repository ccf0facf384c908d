"""A hobby servo that swings a pendulum (Duclusaud et al. 2024): duty and voltage instead of a torque.

The torque is modelled: kt (duty V - kt w) / R, with the published kt and R of the friction model M6, and w
the derivative of the position, because the velocity of the servo lags by 21 ms. A servo without power turns
freely: no current, no torque. The nominal inertia is that of the pendulum, m l2, plus the published armature.
"""

from pathlib import Path

import numpy as np

from reconcile.examples.real.machine import Columns, Joint, Machine, arrays

FOLDER = "bam_pendulum_servos"
PUBLISHER = (
    "the recordings are published at https://github.com/Rhoban/bam (Apache-2.0): put them as npz into "
    f"{FOLDER}, or say where they are with --data"
)
GAINS, MOTIONS = (100, 200, 400), ("lift_and_drop", "sin_sin", "sin_time_square", "up_and_down")
KT_NM_A, RESISTANCE_OHM = 0.303609876267925, 2.444951107725838
"""published_xl330_m6.json."""
MASS_KG, LENGTH_M, ARMATURE_KG_M2 = 0.49, 0.1, 0.0020566024734211697
COUNTS_1_TURN, GEAR = 4096, 288.4
"""From the data sheet of the servo."""


def pendulum(data: Path) -> Machine:
    """Read the pendulum. Raises ReconcileError."""
    names = [f"xl330_kp{gain}_{motion}" for gain in GAINS for motion in MOTIONS]
    return Machine(
        "bam",
        "pendulum on a hobby servo",
        "gravity 0.48 N m times the sine of the angle, load-dependent and Stribeck friction",
        {"servo": Joint(MASS_KG * LENGTH_M**2, ARMATURE_KG_M2, COUNTS_1_TURN, GEAR)},
        {name: _columns(data, name) for name in names},
    )


def _columns(data: Path, name: str) -> Columns:
    read = arrays(data / FOLDER / f"{name}.npz", PUBLISHER)
    time_s, position_rad = read["time_s"], read["position_rad"]
    motor_v = 1e-3 * read["present_pwm_or_load_permille"] * read["voltage_v"]
    velocity_rad_s = np.gradient(position_rad, time_s)
    return {
        "time_s": time_s,
        "servo.motor_position_rad": position_rad,
        "servo.motor_force_nm": read["torque_enable"]
        * (KT_NM_A * (motor_v - KT_NM_A * velocity_rad_s) / RESISTANCE_OHM),
    }
