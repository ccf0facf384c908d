"""Axes on our own bus whose plant holds effects that controller and nominal model know nothing of.

The twin records them as the bus does, bit for bit (tests/hil/test_bus_equals_batch_twin.py), in a second.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from hil_sim.config import load_plant
from kernels.arrays import Array
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program import check_program, program_segments
from twin.rollout import rollout

Columns = Mapping[str, Array]

LEAD_M, TORQUE_CONSTANT_NM_A = 10e-3, 0.43
FORCE_CONSTANT_N_A = TORQUE_CONSTANT_NM_A * 2.0 * np.pi / LEAD_M
SWITCH_ON_CYCLES = 50


class Concealed(NamedTuple):
    """An effect that only the plant has."""

    sections: str
    """Sections of the plant file; the axis is called NAME."""
    parameters: dict[str, tuple[float, float]]
    """True value (SI) and relative tolerance of each parameter to be identified."""
    besides: frozenset[str] = frozenset()
    """Other effects of the plant, which a diagnosis may name too."""


CONCEALED = {
    "backlash": Concealed(
        """
[axis.NAME.backlash]
play_um = 4.0
[axis.NAME.drive_compliance]
stiffness_n_um = 200.0
damping_n_s_m = 5000.0
""",
        {"play_m": (4e-6, 0.05)},
        besides=frozenset({"drive_compliance"}),
    ),
    "drive_compliance": Concealed(
        "[axis.NAME.drive_compliance]\nstiffness_n_um = 40.0\ndamping_n_s_m = 2000.0\n",
        {"stiffness_n_m": (4e7, 0.05)},
    ),
    "cogging": Concealed(
        "[axis.NAME.cogging]\nharmonic = [4.0]\namplitude_n = [3.0]\nphase_deg = [40.0]\n",
        {"amplitude": (3.0, 0.03), "phase_rad": (0.698, 0.05)},
    ),
    "stribeck_friction": Concealed(
        "[axis.NAME.stribeck_friction]\nstribeck_n = 5.0\nstribeck_mm_s = 3.0\n",
        {"stribeck_n": (5.0, 0.1), "stribeck_m_s": (3e-3, 0.15)},
    ),
    "presliding_hysteresis": Concealed(
        "[axis.NAME.presliding_hysteresis]\nlevel_n = 6.0\nway_um = 20.0\n",
        {"level_n": (6.0, 0.1), "way_m": (2e-5, 0.15)},
    ),
    "lead_error_periodic": Concealed(
        "[axis.NAME.lead_error_periodic]\namplitude_um = 3.0\nharmonic = 1.0\nphase_deg = 60.0\n",
        {"amplitude": (3e-6, 0.03), "phase_rad": (1.047, 0.05)},
    ),
}
"""By effect: each is the only difference between plant and nominal model."""


def twin_recording(machine_dir: Path, plant_file: Path, out: Path) -> Path:
    """Write the recording of the machine on this plant by the batch twin, as Parquet; return the file."""
    machine, plant = load_machine(machine_dir), load_plant(plant_file)
    names = list(machine.axes)
    steps = check_program(load_program(machine_dir / "program.toml", machine), machine)
    [segment] = program_segments(steps, machine, np.zeros(len(names)))
    parts = (segment.position_m, segment.velocity_m_s, segment.acceleration_m_s2, segment.force_offset_n)
    rest = np.zeros((2 * SWITCH_ON_CYCLES, 4))
    reference = {
        name: np.concatenate((rest, np.stack([part[:, column] for part in parts], axis=1)))
        for column, name in enumerate(names)
    }
    params = {name: axis_params(machine, name) for name in names}
    columns = rollout(machine, plant, params, reference, off_cycles=SWITCH_ON_CYCLES)
    columns["segment"] = np.where(np.arange(len(columns["time_s"])) < len(rest), -1, 0)
    table = pa.table({name: values[SWITCH_ON_CYCLES:] for name, values in columns.items()})
    parquet.write_table(table, out)
    return out


class Channels(NamedTuple):
    """Channels (n,) by which two recordings of an axis are compared, while the program runs."""

    force_n: Array
    deviation_m: Array
    """Scale position minus motor position."""


def channels(columns: Columns, axis: str) -> Channels:
    """Return the channels of an axis from the columns of a recording."""
    runs = columns["segment"] >= 0
    force_n = columns[f"{axis}.motor_current_a"] * FORCE_CONSTANT_N_A
    deviation_m = columns[f"{axis}.scale_position_m"] - columns[f"{axis}.motor_position_m"]
    return Channels(force_n[runs], deviation_m[runs])


def columns_of(file: Path) -> Columns:
    """Return the columns of a Parquet file."""
    table = parquet.read_table(file)
    return {name: np.asarray(table[name]) for name in table.column_names}


class Difference(NamedTuple):
    """RMS difference between two recordings of one program."""

    force_n: float
    deviation_m: float


def difference(one: Channels, other: Channels) -> Difference:
    """Return the RMS difference; the deviation without its mean, which depends on the scale's zero."""
    force_n = one.force_n - other.force_n
    deviation_m = one.deviation_m - other.deviation_m
    return Difference(float(np.sqrt(np.mean(force_n**2))), float(np.std(deviation_m)))


REPEATS_MM = tuple(count / 9.0 * LEAD_M * 1e3 / 1048576 for count in (1, 3, 5, 7))
"""Starts within one count of the encoder: the same plant with another quantization error."""
NOISE_FLOORS_LEFT = 3.0
"""Largest RMS difference of the updated model's recording, in noise floors."""
NOISE_FLOORS_BEFORE = 10.0
"""Smallest RMS difference of the nominal model's in one of the channels; with less, a case proves nothing."""


def noise_floor(concealed: Channels, repeats: Iterable[Channels]) -> Difference:
    """Return the RMS difference between recordings of one plant, over the repeats.

    Where a table bounces in its play, a step of the encoder decides when it lands: repeats of a plant with a
    play differ by 0.05 to 0.15 N, those of a rigid one by 0.018 N.
    """
    differences = [difference(concealed, one) for one in repeats]
    return Difference(*np.sqrt(np.mean(np.square(differences), axis=0)).tolist())


def disagreements(floor: Difference, before: Difference, after: Difference) -> list[str]:
    """Return the channels in which the updated model disagrees; none if it agrees to the noise floor.

    All are differences to one recording of the concealed plant: of it again, of the nominal model and of the
    written one.
    """
    missed = []
    for sense, noise, stood_out, left in zip(Difference._fields, floor, before, after, strict=True):
        if left >= NOISE_FLOORS_LEFT * noise:
            missed.append(f"{sense}: {left:.3g} left of {stood_out:.3g}, noise floor {noise:.3g}")
    if max(before.force_n / floor.force_n, before.deviation_m / floor.deviation_m) < NOISE_FLOORS_BEFORE:
        missed.append("the nominal model does not stand out: the case proves nothing")
    return missed
