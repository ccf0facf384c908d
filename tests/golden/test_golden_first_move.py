"""The first move of the X-Y table, compared with a stored trace; see first_move/README.md."""

import asyncio
import tempfile
from pathlib import Path

import numpy as np

from servo_ctrl.hil_rig.simulated_run import simulated_run

TABLE = Path(__file__).parents[2] / "machines" / "xy_table"
TRACE = Path(__file__).parent / "first_move" / "trace.csv"
EVERY = 10
TOLERANCES = {
    "position_command_m": 1e-9,
    "motor_position_m": 0.2e-6,
    "scale_position_m": 0.2e-6,
    "motor_current_a": 10e-3,
}
COLUMNS = [f"{axis}.{name}" for axis in ("x", "y") for name in TOLERANCES]


def traced(out: Path) -> np.ndarray:
    """Run the program over the bus; return (n, COLUMNS) of every tenth sample of it."""
    program = TABLE / "programs" / "first_move.toml"
    run = asyncio.run(simulated_run(TABLE, program, out, lambda _progress: None))
    rows = np.flatnonzero(run.recording.columns["segment"] >= 0)[::EVERY]
    return np.column_stack([run.recording.columns[name][rows] for name in COLUMNS])


def test_the_first_move_equals_the_golden_trace(tmp_path: Path) -> None:
    golden = np.loadtxt(TRACE, delimiter=",", skiprows=1)
    trace = traced(tmp_path)
    assert trace.shape == golden.shape
    for index, name in enumerate(COLUMNS):
        tolerance = TOLERANCES[name.partition(".")[2]]
        np.testing.assert_allclose(trace[:, index], golden[:, index], rtol=0.0, atol=tolerance, err_msg=name)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        np.savetxt(
            TRACE, traced(Path(folder)), delimiter=",", header=",".join(COLUMNS), comments="", fmt="%.9e"
        )
