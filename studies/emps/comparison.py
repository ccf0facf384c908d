"""Compares the simulated EMPS axis under our control law with the measurement of the real one.

Janot, Gautier, Brunot (2019), a ball-screw axis, two records of 24.84 s at 1 kHz; the second has pulses of 5
V added after the controller's limit. The published rigid model, simulated in closed loop, has relative force
errors of 5.85 % and 8.94 %.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.recording.reader import Recording

RECORDS = {"train": "emps_train.npz", "pulses": "emps_test_pulses.npz"}
PUBLISHED_FORCE_ERROR_PERCENT = {"train": 5.85, "pulses": 8.94}
"""Relative force error by record, per cent; published by the authors of the data."""
COLUMNS = ("t_s", "q_meas_m", "force_N", "pulse_V", "gtau_N_per_V")
START_SAMPLES = 20
"""Samples that are excluded at the start; from the authors of the data: the real axis was in motion
already."""


class EmpsError(ServoCtrlError):
    """A record is missing, or its file is not an EMPS record."""


class EmpsResult(NamedTuple):
    """Simulated and measured values, arrays (n,), from the first sample of the record on.

    The errors exclude the first START_SAMPLES, as the authors of the data do;
    `force_error_with_start_percent` includes them.
    """

    time_s: Array
    force_n: Array
    measured_force_n: Array
    position_m: Array
    measured_position_m: Array

    @property
    def force_error_percent(self) -> float:
        """Relative error of the force."""
        return relative_error_percent(self.force_n[START_SAMPLES:], self.measured_force_n[START_SAMPLES:])

    @property
    def force_error_with_start_percent(self) -> float:
        """Relative error of the force, start included."""
        return relative_error_percent(self.force_n, self.measured_force_n)

    @property
    def position_error_percent(self) -> float:
        """Relative error of the position."""
        measured_m = self.measured_position_m[START_SAMPLES:]
        return relative_error_percent(self.position_m[START_SAMPLES:], measured_m)

    @property
    def position_rms_um(self) -> float:
        """RMS difference of the positions, micrometres."""
        difference_m = (self.position_m - self.measured_position_m)[START_SAMPLES:]
        return float(1e6 * np.sqrt(np.mean(difference_m**2)))


def relative_error_percent(simulated: Array, measured: Array) -> float:
    """Return 100 |simulated - measured| / |measured| with 2-norms."""
    return float(100.0 * np.linalg.norm(simulated - measured) / np.linalg.norm(measured))


def record_path(data: Path, record: str) -> Path:
    """Return the file of a record. Raises EmpsError naming a missing one."""
    path = data / RECORDS[record]
    if not path.is_file():
        raise EmpsError(
            f"{data}: has no {RECORDS[record]}; name the directory of the EMPS records with --data"
        )
    return path


def load_measurement(path: Path) -> dict[str, Array]:
    """Load the columns of one record, plain arrays only. Raises EmpsError."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: np.asarray(archive[name], dtype=np.float64) for name in COLUMNS}
    except (OSError, KeyError, ValueError) as error:
        raise EmpsError(f"{path}: is not an EMPS record: {error}") from None


def compare(recording: Recording, measurement: dict[str, Array]) -> EmpsResult:
    """Compare a run of the recorded reference with the measurement, sample by sample.

    The force is that of the motor: the command of the controller plus the pulses after its limit.

    Raises:
        EmpsError: the run is shorter than the record.

    """
    rows = np.flatnonzero(recording.columns["segment"] >= 0)
    count = len(measurement["t_s"])
    if len(rows) < count:
        raise EmpsError(f"{recording.directory}: {len(rows)} samples of {count}; the run was cut short")
    rows = rows[:count]
    pulses_n = measurement["pulse_V"] * float(measurement["gtau_N_per_V"])
    return EmpsResult(
        time_s=measurement["t_s"],
        force_n=recording.columns["x.force_command_n"][rows] + pulses_n,
        measured_force_n=measurement["force_N"],
        position_m=recording.columns["x.motor_position_m"][rows],
        measured_position_m=measurement["q_meas_m"],
    )
