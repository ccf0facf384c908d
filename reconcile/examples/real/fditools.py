"""Two-mass bench of the Hori-Fujimoto laboratory: two motors, a flexible coupling, open-loop multisines.

No torque constant is published: a newton metre in these reports is an ampere, so inertias are in A s2/rad.
The nominal inertia is that of the published frequency response at 11 Hz, and half of it turns with the motor.
"""

from pathlib import Path

from reconcile.examples.real.machine import Columns, Joint, Machine, arrays

FOLDER = "fditools_twomass_bench"
PUBLISHER = (
    "the recordings are published at https://github.com/HoriFujimotoLab/FdiTools (MIT), Examples/private: "
    f"put them as npz into {FOLDER}, or say where they are with --data"
)
RECORDINGS = ("MultisineTypeA", "MultisineTypeB")
TOTAL_A_S2 = 1.0 / 107.0
"""From the bench's frequency response: 107 rad/s2 per ampere at 11 Hz, 231 on the motor side at 200 Hz."""
ROTOR_A_S2 = 1.0 / 231.0


def motor_only(data: Path) -> Machine:
    """Read the bench with the motor encoder alone. Raises ReconcileError."""
    joint = Joint(TOTAL_A_S2 - ROTOR_A_S2, ROTOR_A_S2)
    recordings = {name: _columns(data, name, with_load=False) for name in RECORDINGS}
    return Machine(
        "fditools_motor",
        "two-mass bench, motor encoder alone",
        "resonance near 78 Hz, antiresonance near 53 Hz",
        {"motor": joint},
        recordings,
    )


def with_load_encoder(data: Path) -> Machine:
    """Read the bench with motor and load encoders. Raises ReconcileError."""
    motor = motor_only(data)
    recordings = {name: _columns(data, name, with_load=True) for name in RECORDINGS}
    return motor._replace(name="fditools_load", title="two-mass bench, both encoders", recordings=recordings)


def _columns(data: Path, name: str, *, with_load: bool) -> Columns:
    read = arrays(data / FOLDER / f"{name}.npz", PUBLISHER)
    columns = {
        "time_s": read["time_s"],
        "motor.motor_position_rad": read["position_rad"],
        "motor.motor_current_a": read["current_a"],
    }
    if with_load:
        columns["motor.scale_position_rad"] = read["load_position_rad"]
    return columns
