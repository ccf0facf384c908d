"""Record a drawn axis along a given motion: further recordings of the same machine."""

from pathlib import Path
from unittest.mock import patch

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tests.campaigns.blind import recorded
from tests.campaigns.blind.arrays import Array
from tests.campaigns.blind.case import Case, Run, SimulatedRecording

SEED = 20261
"""First part of the seeds of further recordings, which no drawn recording uses; chosen."""


def simulated_along(case: Case, position_m: Array, number: int) -> SimulatedRecording:
    """Simulate the axis along positions (n,), one each `case.control_s`; 0 is the middle of the travel.

    The machine stays on: the encoder's zero is that of the first recording, and the temperature rise
    is that at the end of the last one. `number` of the recording, from 1: noise is drawn anew for each.
    """
    velocity = np.gradient(position_m, case.control_s)
    reference = np.stack((position_m, velocity, np.gradient(velocity, case.control_s)), axis=1)
    first, last = case.runs[0], case.runs[-1]
    seed = int(np.random.default_rng([SEED, case.seed, number]).integers(2**31))
    run = Run("further", len(position_m) * case.control_s, first.start_m, last.warm_to, last.warm_to, seed)
    with patch.object(recorded, "set_points", lambda *_: reference):  # all else is as in any recording
        return recorded.simulated(case, run)


def record_along(
    case: Case, position_m: Array, number: int, directory: Path
) -> tuple[Path, SimulatedRecording]:
    """Simulate, and write the recording beside those of the case."""
    recording = simulated_along(case, position_m, number)
    path = directory / f"further_{number}.parquet"
    pq.write_table(pa.table(recording.columns), path)
    return path, recording
