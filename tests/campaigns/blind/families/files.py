"""Write a case to files: recordings and a model file for the tool, the truth sealed beside them."""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from tests.campaigns.blind.families.interface import Case, Channels
from tests.campaigns.blind.families.judge import drawn

COLUMNS = {
    "time": "time_s",
    "motor": "motor_position_m",
    "force": "motor_force_n",
    "scale": "scale_position_m",
    "command": "position_command_m",
    "temperature": "temperature_k",
}
ROTARY = {
    "motor": "joint_position_rad",
    "force": "joint_torque_nm",
    "scale": "scale_position_rad",
    "command": "position_command_rad",
}
SEALED = "sealed"


def record(case: Case, directory: Path) -> tuple[list[Path], str]:
    """Write recordings, `model.toml` and `sealed/truth.json`; return paths and the truth's hash."""
    directory.mkdir(parents=True, exist_ok=True)
    (directory / SEALED).mkdir(exist_ok=True)
    made = drawn(case)
    paths = write_recordings(case, made.recordings, directory)
    (directory / "model.toml").write_text(model_text(case), encoding="utf-8")
    text = json.dumps(made.truth, indent=1) + "\n"
    (directory / SEALED / "truth.json").write_text(text, encoding="utf-8")
    return paths, hashlib.sha256(text.encode()).hexdigest()


def write_recordings(case: Case, recordings: Sequence[Channels], directory: Path) -> list[Path]:
    """Write one file a recording, as the case has them; return their paths."""
    paths = []
    names = COLUMNS | (ROTARY if case.rotary else {})
    for number, channels in enumerate(recordings, start=1):
        table = pa.table({names[key]: values for key, values in channels.items()})
        path = directory / f"recording_{number}.{'csv' if case.as_csv else 'parquet'}"
        if case.as_csv:
            pyarrow.csv.write_csv(table, path)
        else:
            pq.write_table(table, path)
        paths.append(path)
    return paths


def model_text(case: Case) -> str:
    """Return the smallest model file that says what the nominal model knows."""
    n = case.nominal
    if case.rotary:
        return f"""[axis.j]
motion = "rotary"
transmission.gear_ratio = {n.gear_ratio!r}
table.inertia_kg_m2 = {n.inertia!r}
viscous_friction.viscous_nm_s_rad = {n.viscous!r}
coulomb_friction.coulomb_nm = {n.coulomb!r}
"""
    text = f"""[axis.x]
transmission.lead_mm = {n.lead_m * 1e3!r}
motor.torque_constant_nm_a = 0.5
table.mass_kg = {n.inertia!r}
viscous_friction.viscous_n_s_m = {n.viscous!r}
coulomb_friction.coulomb_n = {n.coulomb!r}
encoder.counts_per_rev = {round(n.lead_m / n.motor_count)}
"""
    if n.scale_count:
        text += f"scale.resolution_um = {n.scale_count * 1e6!r}\n"
    if n.constant_n:
        text += f"constant_force.force_n = {n.constant_n!r}\n"
    return text
